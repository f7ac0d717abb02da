//! A policy in memory.

use std::sync::Arc;

use crate::{
    Mlp, PolicyContext, PolicyError, PolicyFault, PolicyFile, RowPolicy, RowShape,
    format::{FileFormat, ProgramKind, way_out},
    network::{Network, read_weights},
    onnx::OnnxModel,
    program::{self, ProgramPolicy},
};

/// A policy with all its data in memory; clones share it.
#[derive(Clone, Debug)]
pub struct LoadedFile {
    file: PolicyFile,
    content: FileContent,
}

#[derive(Clone, Debug)]
enum FileContent {
    Network(Arc<Mlp>),
    Graph(OnnxModel),
    Program,
}

impl PolicyFile {
    /// Loads the policy.
    ///
    /// # Errors
    /// [`PolicyError`] with the file, the expected content and the actual content.
    pub fn load(&self) -> Result<LoadedFile, PolicyError> {
        load(self).map_err(|why| PolicyError {
            spec: self.path.clone(),
            why: why.to_string(),
        })
    }
}

fn load(file: &PolicyFile) -> Result<LoadedFile, PolicyFault> {
    let (content, digest) = file.read()?;
    let format = FileFormat::detect(&content);
    let pinned = PolicyFile {
        sha256: Some(digest),
        is_program: file.is_program || program::is_program(&file.path, &content, format)?,
        ..file.clone()
    };
    let content = if pinned.is_program {
        FileContent::Program
    } else if format == FileFormat::Onnx {
        FileContent::Graph(OnnxModel::open(&content)?)
    } else {
        FileContent::Network(Arc::new(read_weights(&content)?))
    };
    Ok(LoadedFile {
        file: pinned,
        content,
    })
}

impl LoadedFile {
    /// Returns the file, pinned to the loaded content.
    pub fn file(&self) -> &PolicyFile {
        &self.file
    }

    /// Checks that its answers fit a run with `chunk` actions in each, or with single actions.
    ///
    /// # Errors
    /// [`PolicyError`] if a network answers with other chunks.
    pub fn check_chunk(&self, chunk: Option<usize>, shape: RowShape) -> Result<(), PolicyError> {
        let actions = match &self.content {
            FileContent::Network(weights) => weights.actions(),
            FileContent::Graph(graph) => graph
                .outputs(shape.sees)
                .map_err(|why| self.error(why.to_string()))?,
            FileContent::Program => return Ok(()),
        };
        let wants = match (chunk, shape.acts) {
            (_, Some(controls)) if actions == controls => return Ok(()),
            (_, Some(controls)) => {
                let way_out = way_out(None);
                return Err(self.error(format!(
                    "its answers are {actions} numbers, and the robot has {controls} controls; {way_out}"
                )));
            }
            (chunk, None) if actions == 1 || chunk == Some(actions) => return Ok(()),
            (None, None) => "one action".to_owned(),
            (Some(wanted), None) => format!("chunks of {wanted} actions"),
        };
        let way_out = way_out(Some(ProgramKind::Module));
        let remedy = if actions == 2 {
            format!(
                "if they are the values of two choices, {way_out}; if they are the next 2 actions, give --chunk 2"
            )
        } else {
            format!(
                "give --chunk {actions} if they are the next {actions} actions; if not, {way_out}"
            )
        };
        Err(self.error(format!(
            "its answers are {actions} numbers, and the run wants {wants}: {remedy}"
        )))
    }

    /// Creates the policy in its initial state.
    ///
    /// # Errors
    /// [`PolicyError`] if it sees another number of numbers.
    pub fn policy(
        &self,
        context: PolicyContext,
        shape: RowShape,
    ) -> Result<Box<dyn RowPolicy>, PolicyError> {
        let inputs = match &self.content {
            FileContent::Network(weights) => Some(weights.inputs()),
            FileContent::Graph(graph) => graph.inputs(),
            FileContent::Program => None,
        };
        if let Some(inputs) = inputs.filter(|inputs| *inputs != shape.sees) {
            let sees = shape.sees;
            let remedy = match shape.acts {
                Some(_) => "observe = [...] says what it was trained on".to_owned(),
                None => way_out(Some(ProgramKind::Module)),
            };
            return Err(self.error(format!(
                "it sees {inputs} numbers, and an observation has {sees}: {remedy}"
            )));
        }
        Ok(match &self.content {
            FileContent::Network(weights) => Box::new(Network::new(weights.clone())),
            FileContent::Graph(model) => model.policy(),
            FileContent::Program => Box::new(ProgramPolicy::new(self.file.clone(), context, shape)),
        })
    }

    fn name(&self) -> &str {
        self.file.name()
    }

    /// An error of the policy.
    pub fn error(&self, why: String) -> PolicyError {
        PolicyError {
            spec: self.name().to_owned(),
            why,
        }
    }
}

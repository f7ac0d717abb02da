//! A policy in memory.

use std::sync::Arc;

use crate::{
    Mlp, PolicyContext, PolicyError, PolicyFault, PolicyFile, RowPolicy, RowShape,
    choice::Choice,
    format::{FileFormat, ProgramKind, way_out},
    network::{Network, read_with},
    onnx::OnnxModel,
    program::{self, ProgramPolicy},
};

/// What to do with a policy of Gymnasium's cart-pole.
const GYMNASIUM: &str = "--observe \"x v theta spin\" is for Gymnasium's CartPole-v1";

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
            why: Box::new(why),
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
    let is_network = !pinned.is_program && format != FileFormat::Onnx;
    if let (Some(activation), false) = (file.activation, is_network) {
        let what = format!("#{activation} is for a file of weights: leave it out");
        return Err(PolicyFault::Other(what));
    }
    let content = if pinned.is_program {
        FileContent::Program
    } else if format == FileFormat::Onnx {
        FileContent::Graph(OnnxModel::open(&content)?)
    } else {
        FileContent::Network(Arc::new(read_with(&content, file.activation)?))
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

    /// Returns how many numbers its answers have; `None` for a program.
    fn answers(&self, shape: RowShape) -> Result<Option<usize>, PolicyError> {
        match &self.content {
            FileContent::Network(weights) => Ok(Some(weights.actions())),
            FileContent::Graph(graph) => graph
                .outputs(shape.sees)
                .map(Some)
                .map_err(|why| self.error(why)),
            FileContent::Program => Ok(None),
        }
    }

    /// Returns whether its outputs are the values of choices; `None` if nothing says it.
    fn chooses(&self) -> Option<bool> {
        match &self.content {
            FileContent::Network(weights) => weights.chooses(),
            FileContent::Graph(_) | FileContent::Program => None,
        }
    }

    /// Checks that its answers fit a run with `chunk` actions in each, or with single actions.
    ///
    /// # Errors
    /// [`PolicyError`] if a network answers with other chunks.
    pub fn check_chunk(&self, chunk: Option<usize>, shape: RowShape) -> Result<(), PolicyError> {
        let Some(actions) = self.answers(shape)? else {
            return Ok(());
        };
        let chooses = self.chooses();
        let wants = match (chunk, shape.acts) {
            (chunk, Some(controls))
                if chooses != Some(true)
                    && [controls, chunk.unwrap_or(1) * controls].contains(&actions) =>
            {
                return Ok(());
            }
            (_, Some(controls))
                if chooses != Some(true) && actions > controls && actions % controls == 0 =>
            {
                let length = actions / controls;
                return Err(self.unfit(format!(
                    "its answers are {actions} numbers, and an action of the robot has {controls}: give \
                     --chunk {length} if they are the next {length} actions"
                )));
            }
            (_, Some(controls)) => {
                let what = match chooses {
                    Some(true) => "values of choices",
                    _ => "numbers",
                };
                let way_out = way_out(None);
                return Err(self.unfit(format!(
                    "its answers are {actions} {what}, and the robot has {controls} controls; {way_out}"
                )));
            }
            (_, None) if actions == 2 && chooses != Some(false) => return Ok(()),
            (chunk, None) if actions == 1 || chunk == Some(actions) => return Ok(()),
            (None, None) => "one action".to_owned(),
            (Some(wanted), None) => format!("chunks of {wanted} actions"),
        };
        let way_out = way_out(Some(ProgramKind::Module));
        Err(self.unfit(format!(
            "its answers are {actions} numbers, and the run wants {wants}: give --chunk {actions} if \
             they are the next {actions} actions; if not, {way_out}"
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
                None => {
                    let way_out = way_out(Some(ProgramKind::Module));
                    format!("{GYMNASIUM}; else {way_out}")
                }
            };
            return Err(self.unfit(format!(
                "it sees {inputs} numbers, and an observation has {sees}: {remedy}"
            )));
        }
        let answers = self.answers(shape)?;
        let policy: Box<dyn RowPolicy> = match &self.content {
            FileContent::Network(weights) => Box::new(Network::new(weights.clone(), shape.width())),
            FileContent::Graph(model) => model.policy(answers.unwrap_or(1), shape.width()),
            FileContent::Program => {
                let program = ProgramPolicy::new(self.file.clone(), context, shape);
                return Ok(Box::new(program));
            }
        };
        let is_of_two = answers == Some(2) && self.chooses() != Some(false);
        let is_chunk = context.chunk == Some(2) && self.chooses() != Some(true);
        Ok(if shape.acts.is_none() && is_of_two && !is_chunk {
            Box::new(Choice::new(policy))
        } else {
            policy
        })
    }

    fn name(&self) -> &str {
        self.file.name()
    }

    /// Returns an error of the policy.
    pub(crate) fn error(&self, why: PolicyFault) -> PolicyError {
        PolicyError {
            spec: self.name().to_owned(),
            why: Box::new(why),
        }
    }

    /// Returns the error of a policy that does not fit the run.
    fn unfit(&self, why: String) -> PolicyError {
        self.error(PolicyFault::Other(why))
    }
}

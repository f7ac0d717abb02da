//! A policy by name: built in, or in a file.

use std::{fmt, path::Path, str::FromStr, sync::Arc};

use serde::{Deserialize, Serialize};

use super::{
    Lqr, Policy, PolicyContext, PolicyFile, PolicyKind, Random, Scripted, UnknownPolicy, Zero,
    error::{PolicyError, PolicyFault},
    format::{FileFormat, ProgramKind, way_out},
    network::{Mlp, Network, read_weights},
    onnx::OnnxModel,
    program::{self, ProgramPolicy},
};

/// The choice of a policy. As text: the name of a built-in policy, or else the path of a
/// file of weights or of a program; a file with the name of a built-in is written as `./scripted`.
///
/// ```
/// use ratelab_cart_pole::policy::{PolicyKind, PolicySpec};
///
/// assert_eq!("lqr".parse(), Ok(PolicySpec::BuiltIn(PolicyKind::Lqr)));
/// let file: PolicySpec = "policies/swing.safetensors".parse()?;
/// assert_eq!(file.name(), "swing.safetensors");
/// # Ok::<(), ratelab_cart_pole::policy::UnknownPolicy>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum PolicySpec {
    /// A policy without a file.
    BuiltIn(PolicyKind),
    /// The weights of a network, or a program.
    File(PolicyFile),
}

impl PolicySpec {
    /// Returns a short name: that of the policy, or of the file without its folder.
    pub fn name(&self) -> &str {
        match self {
            Self::BuiltIn(kind) => kind.name(),
            Self::File(file) => {
                let name = Path::new(&file.path).file_name();
                name.and_then(|name| name.to_str()).unwrap_or(&file.path)
            }
        }
    }

    /// Loads the policy.
    ///
    /// # Errors
    /// [`PolicyError`] with the file, the expected content and the actual content. It
    /// never falls back to another policy.
    pub fn load(&self) -> Result<LoadedPolicy, PolicyError> {
        match self {
            Self::BuiltIn(kind) => Ok(LoadedPolicy {
                spec: self.clone(),
                content: SpecContent::BuiltIn(*kind),
            }),
            Self::File(file) => load(file).map_err(|why| PolicyError {
                spec: file.path.clone(),
                why: why.to_string(),
            }),
        }
    }

    /// Returns whether it is known to be a program.
    pub fn is_program(&self) -> bool {
        matches!(self, Self::File(file) if file.is_program)
    }
}

fn load(file: &PolicyFile) -> Result<LoadedPolicy, PolicyFault> {
    let (content, digest) = file.read()?;
    let format = FileFormat::detect(&content);
    let pinned = PolicyFile {
        sha256: Some(digest),
        is_program: file.is_program || program::is_program(&file.path, &content, format)?,
        ..file.clone()
    };
    let content = if pinned.is_program {
        SpecContent::Program(pinned.clone())
    } else if format == FileFormat::Onnx {
        SpecContent::Graph(OnnxModel::open(&content)?)
    } else {
        let weights = read_weights(&content)?;
        SpecContent::Network(Arc::new(weights))
    };
    let spec = PolicySpec::File(pinned);
    Ok(LoadedPolicy { spec, content })
}

impl From<PolicyKind> for PolicySpec {
    fn from(kind: PolicyKind) -> Self {
        Self::BuiltIn(kind)
    }
}

impl fmt::Display for PolicySpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BuiltIn(kind) => kind.fmt(f),
            Self::File(file) => file.fmt(f),
        }
    }
}

impl FromStr for PolicySpec {
    type Err = UnknownPolicy;

    fn from_str(text: &str) -> Result<Self, UnknownPolicy> {
        let mut kinds = PolicyKind::ALL.into_iter();
        match kinds.find(|kind| kind.name() == text) {
            Some(kind) => Ok(Self::BuiltIn(kind)),
            None if text.trim().is_empty() => Err(UnknownPolicy(text.to_owned())),
            None => Ok(Self::File(PolicyFile::parse(text))),
        }
    }
}

/// A policy with all its data in memory; clones share it.
#[derive(Clone, Debug)]
pub struct LoadedPolicy {
    spec: PolicySpec,
    content: SpecContent,
}

#[derive(Clone, Debug)]
enum SpecContent {
    BuiltIn(PolicyKind),
    Network(Arc<Mlp>),
    Graph(OnnxModel),
    Program(PolicyFile),
}

impl LoadedPolicy {
    /// Returns the choice of this policy; a file is pinned to the loaded content.
    pub fn spec(&self) -> &PolicySpec {
        &self.spec
    }

    /// Checks that its answers fit a run with `chunk` actions in each, or with single actions.
    ///
    /// # Errors
    /// [`PolicyError`] if a network answers with other chunks.
    pub fn check_chunk(&self, chunk: Option<usize>) -> Result<(), PolicyError> {
        let SpecContent::Network(weights) = &self.content else {
            return Ok(());
        };
        let actions = weights.actions();
        let wants = match chunk {
            _ if actions == 1 || chunk == Some(actions) => return Ok(()),
            None => "one action".to_owned(),
            Some(wanted) => format!("chunks of {wanted} actions"),
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
    /// [`PolicyError`] if the regulator cannot be computed for the control rate.
    pub fn policy(&self, context: PolicyContext) -> Result<Box<dyn Policy>, PolicyError> {
        Ok(match &self.content {
            SpecContent::BuiltIn(PolicyKind::Scripted) => Box::new(Scripted),
            SpecContent::BuiltIn(PolicyKind::Zero) => Box::new(Zero),
            SpecContent::BuiltIn(PolicyKind::Random) => Box::new(Random::new(context.seed)),
            SpecContent::BuiltIn(PolicyKind::Lqr) => {
                let lqr = Lqr::at(context.control_hz);
                Box::new(lqr.map_err(|why| self.error(why.to_string()))?)
            }
            SpecContent::Program(file) => {
                Box::new(ProgramPolicy::new(self.spec.name(), file.clone(), context))
            }
            SpecContent::Graph(model) => model.policy(self.spec.name()),
            SpecContent::Network(weights) => {
                Box::new(Network::new(self.spec.name(), weights.clone()))
            }
        })
    }

    pub(super) fn error(&self, why: String) -> PolicyError {
        PolicyError {
            spec: self.spec.name().to_owned(),
            why,
        }
    }
}

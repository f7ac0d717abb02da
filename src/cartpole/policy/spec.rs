//! A policy by name: built in, or in a file.

use std::{fmt, path::Path, str::FromStr, sync::Arc};

use serde::{Deserialize, Serialize};

use super::{
    Lqr, Policy, PolicyFile, PolicyKind, Random, Scripted, UnknownPolicy, Zero,
    error::{PolicyError, PolicyErrorKind},
    network::{Mlp, Network, read_weights},
    onnx::{Model, is_onnx},
};
use crate::runtime::Hz;

/// Which policy decides. As text: the name of one that is built in, or else
/// the path of a file; a file that is called like a built-in is `./scripted`.
///
/// ```
/// use ratelab::policy::{PolicyKind, PolicySpec};
///
/// assert_eq!("lqr".parse(), Ok(PolicySpec::BuiltIn(PolicyKind::Lqr)));
/// let file: PolicySpec = "policies/swing.safetensors".parse()?;
/// assert_eq!(file.name(), "swing.safetensors");
/// # Ok::<(), ratelab::policy::UnknownPolicy>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(untagged)]
pub enum PolicySpec {
    /// One that needs no file.
    BuiltIn(PolicyKind),
    /// The weights of a network.
    File(PolicyFile),
}

impl PolicySpec {
    /// A short name: that of the policy, or that of the file without its folder.
    pub fn name(&self) -> &str {
        match self {
            Self::BuiltIn(kind) => kind.name(),
            Self::File(file) => {
                let name = Path::new(file.path()).file_name();
                name.and_then(|name| name.to_str()).unwrap_or(file.path())
            }
        }
    }

    /// Whether it tries to keep the pole up, as far as is known.
    pub fn balances(&self) -> bool {
        match self {
            Self::BuiltIn(kind) => kind.balances(),
            Self::File(_) => true,
        }
    }

    /// Reads what it needs.
    ///
    /// # Errors
    /// [`PolicyError`] names the file, what was expected and what was found. No
    /// other policy ever takes its place.
    pub fn load(&self) -> Result<LoadedPolicy, PolicyError> {
        match self {
            Self::BuiltIn(kind) => Ok(LoadedPolicy {
                spec: self.clone(),
                content: Content::BuiltIn(*kind),
            }),
            Self::File(file) => load(file).map_err(|kind| PolicyError {
                spec: file.path().to_owned(),
                kind,
            }),
        }
    }

    /// Whether it means the same policy at any time: a file is known by the digest
    /// of its content.
    pub fn is_pinned(&self) -> bool {
        match self {
            Self::BuiltIn(_) => true,
            Self::File(file) => file.is_pinned(),
        }
    }
}

fn load(file: &PolicyFile) -> Result<LoadedPolicy, PolicyErrorKind> {
    let (content, digest) = file.read()?;
    let content = if is_onnx(&content) {
        Content::Graph(Model::open(&content)?)
    } else {
        Content::Network(Arc::new(read_weights(&content)?))
    };
    let spec = PolicySpec::File(PolicyFile::new(file.path(), Some(digest)));
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
        match text.parse() {
            Ok(kind) => Ok(Self::BuiltIn(kind)),
            Err(unknown) if text.trim().is_empty() => Err(unknown),
            Err(_) => Ok(Self::File(PolicyFile::parse(text))),
        }
    }
}

/// What a policy may depend on beside its observations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PolicyContext {
    /// The seed of the run.
    pub seed: u64,
    /// How often the policy decides when the run begins.
    pub control_hz: Hz,
}

/// A policy with all that it needs in memory; copies share it.
#[derive(Clone, Debug)]
pub struct LoadedPolicy {
    spec: PolicySpec,
    content: Content,
}

#[derive(Clone, Debug)]
enum Content {
    BuiltIn(PolicyKind),
    Network(Arc<Mlp>),
    Graph(Model),
}

impl LoadedPolicy {
    /// Which policy it is; a file is pinned to the content that was read.
    pub fn spec(&self) -> &PolicySpec {
        &self.spec
    }

    /// The policy itself, as it is when a run begins.
    ///
    /// # Errors
    /// [`PolicyError`] if the regulator cannot be worked out for the control rate.
    pub fn policy(&self, context: PolicyContext) -> Result<Box<dyn Policy>, PolicyError> {
        Ok(match &self.content {
            Content::BuiltIn(PolicyKind::Scripted) => Box::new(Scripted),
            Content::BuiltIn(PolicyKind::Zero) => Box::new(Zero),
            Content::BuiltIn(PolicyKind::Random) => Box::new(Random::new(context.seed)),
            Content::BuiltIn(PolicyKind::Lqr) => {
                let lqr = Lqr::at(context.control_hz).map_err(|why| PolicyError {
                    spec: self.spec.to_string(),
                    kind: why.into(),
                })?;
                Box::new(lqr)
            }
            Content::Graph(model) => model.policy(self.spec.name()),
            Content::Network(weights) => Box::new(Network::new(self.spec.name(), weights.clone())),
        })
    }
}

//! A policy by name: built in, or in a file.

use std::{fmt, str::FromStr};

use ratelab_policy::{LoadedFile, PolicyContext, PolicyError, PolicyFault, PolicyFile};
use serde::{Deserialize, Serialize};

use super::{
    CartTerms, Lqr, LqrError, Policy, PolicyKind, Random, Scripted, UnknownPolicy, Zero,
    built_in::EXPECTED,
    rows::{FilePolicy, shape},
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
            Self::File(file) => file.name(),
        }
    }

    /// Loads the policy.
    ///
    /// # Errors
    /// [`PolicyError`] with the file, the expected content and the actual content. It
    /// never falls back to another policy.
    pub fn load(&self) -> Result<LoadedPolicy, PolicyError> {
        self.load_by(&CartTerms::default(), PolicyFile::load)
    }

    /// Loads the policy; a file by `load`, which is to see these `terms`.
    pub(super) fn load_by(
        &self,
        terms: &CartTerms,
        load: impl FnOnce(&PolicyFile) -> Result<LoadedFile, PolicyError>,
    ) -> Result<LoadedPolicy, PolicyError> {
        Ok(match self {
            Self::BuiltIn(kind) => LoadedPolicy {
                spec: self.clone(),
                content: SpecContent::BuiltIn(*kind),
                terms: terms.clone(),
            },
            Self::File(file) => {
                let loaded = load(file).map_err(with_names)?;
                LoadedPolicy {
                    spec: Self::File(loaded.file().clone()),
                    content: SpecContent::File(loaded),
                    terms: terms.clone(),
                }
            }
        })
    }

    /// Returns whether it is known to be a program.
    pub fn is_program(&self) -> bool {
        matches!(self, Self::File(file) if file.is_program)
    }
}

/// Returns an error; of a file that does not exist with the policies that have none.
pub(super) fn with_names(error: PolicyError) -> PolicyError {
    match *error.why {
        PolicyFault::Missing => PolicyError {
            why: other(format!("expected {EXPECTED}; {}", error.why)),
            ..error
        },
        _ => error,
    }
}

fn other(why: String) -> Box<PolicyFault> {
    Box::new(PolicyFault::Other(why))
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
    /// What it sees, if it is in a file.
    terms: CartTerms,
}

#[derive(Clone, Debug)]
enum SpecContent {
    BuiltIn(PolicyKind),
    File(LoadedFile),
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
        match &self.content {
            SpecContent::BuiltIn(_) => Ok(()),
            SpecContent::File(file) => file.check_chunk(chunk, shape(&self.terms)),
        }
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
                let error = |why: LqrError| PolicyError {
                    spec: self.spec.name().to_owned(),
                    why: other(why.to_string()),
                };
                Box::new(lqr.map_err(error)?)
            }
            SpecContent::File(file) => {
                let rows = file.policy(context, shape(&self.terms))?;
                Box::new(FilePolicy::new(self.spec.name(), rows, self.terms.clone()))
            }
        })
    }
}

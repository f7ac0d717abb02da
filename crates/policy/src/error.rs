//! The errors of policies.

use ratelab::Digest;
use thiserror::Error;

use crate::{
    ProgramError,
    format::{ProgramKind, way_out},
};

/// An error while loading a policy.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{spec}: {why}")]
pub struct PolicyError {
    /// Name or path of the policy.
    pub spec: String,
    /// The reason: what was expected, and what was found.
    pub why: Box<PolicyFault>,
}

/// Why a policy was not loaded, started, replaced or restarted.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum PolicyFault {
    /// The policy with this name cannot be replaced by another.
    #[error("the {0} policy cannot be swapped")]
    Fixed(String),
    /// The initial state of the policy with this name is unknown.
    #[error("the {0} policy cannot restart")]
    NoRestart(String),
    /// A policy with its name, and what is wrong with it.
    #[error(transparent)]
    Policy(#[from] PolicyError),
    /// There is no such file.
    #[error("found neither a policy nor a file of that name")]
    Missing,
    /// A file with other content than the name of the policy says.
    #[error("expected the content with the SHA-256 {expected}, found another one: {found}")]
    Changed {
        /// The digest in the name.
        expected: Digest,
        /// The digest of the file.
        found: Digest,
    },
    /// A file with weights that do not fit.
    #[error(transparent)]
    Weights(#[from] WeightsError),
    /// A program that does not answer as it must.
    #[error(transparent)]
    Program(#[from] ProgramError),
    /// Any other reason, in words, also for a policy of your own.
    #[error("{0}")]
    Other(String),
}

/// Why no network was read from a file.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum WeightsError {
    /// The file is damaged, or too large.
    #[error("{0}")]
    Damaged(String),
    /// The file holds another policy than the network that is computed here; a program may run it.
    #[error("{why}; {}", way_out(*.program))]
    Unfit {
        /// What was expected, and what was found.
        why: String,
        /// The kind of that program, if any.
        program: Option<ProgramKind>,
    },
}

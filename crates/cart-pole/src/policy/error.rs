//! The errors of policies.

use ratelab::Digest;
use thiserror::Error;

use super::{WeightsError, program::ProgramError};

/// An error while loading a policy.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{spec}: {why}")]
pub struct PolicyError {
    /// Name or path of the policy.
    pub spec: String,
    /// The reason: what was expected, and what was found.
    pub why: String,
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

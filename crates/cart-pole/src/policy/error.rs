//! The error of loading a policy.

use thiserror::Error;

/// An error while loading a policy.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{spec}: {why}")]
pub struct PolicyError {
    /// Name or path of the policy.
    pub spec: String,
    /// The reason: what was expected, and what was found.
    pub why: String,
}

//! Errors of the connection.

use thiserror::Error;

/// An error of the connection.
#[derive(Debug, Error)]
pub enum WireError {
    /// An invalid setting, with a remedy.
    #[error("{0}")]
    Setting(String),
    /// Another process has a node of this one, with a remedy.
    #[error("{0}")]
    Taken(String),
    /// The network refused.
    #[error("{what}: {why}")]
    Network {
        /// What was tried.
        what: String,
        /// The reason.
        why: String,
    },
}

impl WireError {
    /// An error of zenoh while trying `what`.
    pub(crate) fn network(what: &str, why: &dyn std::fmt::Display) -> Self {
        let why = why.to_string();
        // The rest of the text is about zenoh's source.
        let why = why.split(" at /").next().unwrap_or_default().to_owned();
        let what = what.to_owned();
        Self::Network { what, why }
    }
}

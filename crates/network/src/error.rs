//! Errors of the connection.

use std::fmt::Display;

use thiserror::Error;

/// An error of the connection.
#[derive(Debug, Error)]
pub enum NetworkError {
    /// An invalid setting, with a remedy.
    #[error("{0}")]
    Setting(String),
    /// Another process has a node of this one, with a remedy.
    #[error("{0}")]
    Taken(String),
    /// The network refused: what was tried, and the reason.
    #[error("{0}")]
    Network(String),
}

impl NetworkError {
    /// An error of zenoh while trying `what`.
    pub(crate) fn network(what: &impl Display, why: &impl Display) -> Self {
        Self::Network(format!("{what}: {}", reason(why)))
    }
}

/// A result whose error becomes one of the connection.
pub(crate) trait Attempted<T> {
    /// This result, with `what` was tried in the error.
    fn tried(self, what: impl Display) -> Result<T, NetworkError>;
}

impl<T, E: Display> Attempted<T> for Result<T, E> {
    fn tried(self, what: impl Display) -> Result<T, NetworkError> {
        self.map_err(|why| NetworkError::network(&what, &why))
    }
}

/// The text of an error of zenoh, without the place in zenoh's source.
pub(crate) fn reason(why: &impl Display) -> String {
    let why = why.to_string();
    why.split(" at /").next().unwrap_or_default().to_owned()
}

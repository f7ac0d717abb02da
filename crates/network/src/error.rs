//! Errors of the connection, and the threads that it needs.

use std::{
    fmt::Display,
    thread::{self, JoinHandle},
    time::Duration,
};

use crossbeam_channel::{RecvTimeoutError, Sender, bounded};
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
    /// Returns an error of zenoh while trying `what`.
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

/// Returns the text of an error of zenoh, without the place in zenoh's source.
pub(crate) fn reason(why: &impl Display) -> String {
    let why = why.to_string();
    why.split(" at /").next().unwrap_or_default().to_owned()
}

/// Begins a thread.
pub(crate) fn spawn<T: Send + 'static>(
    name: impl Into<String>,
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<JoinHandle<T>, NetworkError> {
    let begun = thread::Builder::new().name(name.into()).spawn(work);
    begun.tried("cannot start a thread")
}

/// Work that is done again and again, and once more when this is dropped.
pub(crate) struct Beat(Option<(Sender<()>, JoinHandle<()>)>);

impl Beat {
    /// Does `work` at once, and again after each `pause`.
    pub(crate) fn begin(
        name: &str,
        pause: Duration,
        mut work: impl FnMut() + Send + 'static,
    ) -> Result<Self, NetworkError> {
        let (end, ended) = bounded(0);
        let thread = spawn(name, move || {
            work();
            while ended.recv_timeout(pause) == Err(RecvTimeoutError::Timeout) {
                work();
            }
            work();
        })?;
        Ok(Self(Some((end, thread))))
    }
}

impl Drop for Beat {
    fn drop(&mut self) {
        if let Some((end, thread)) = self.0.take() {
            drop(end);
            let _ = thread.join();
        }
    }
}

//! Errors of the screen and of keys.

use ratelab::{Fault, Time};
use ratelab_recording::RecordError;
use ratelab_system::BuildError;
use thiserror::Error;

/// Why the screen ends other than by a key.
#[derive(Debug, Error)]
pub enum ScreenError {
    /// A node failed.
    #[error(transparent)]
    Fault(#[from] Fault),
    /// A run could not be started.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// A clock's own thread panicked.
    #[error("the clock panicked, which is a defect of ratelab: please report it")]
    Panicked,
    /// A run was left because it did not end.
    #[error("the run did not end in order: {0} is still in a tick")]
    Stuck(String),
    /// A recording cannot begin.
    #[error("cannot record: {}: {}", .0.why, .0.path.display())]
    Record(RecordError),
    /// The rows of a CSV file cannot be written.
    #[error("--csv: {0}")]
    Csv(std::io::Error),
    /// The terminal cannot be read or written.
    #[error("the terminal failed: {0}")]
    Terminal(#[from] std::io::Error),
}

/// Why what a key, or a typed line, asked for is not done: the text of a notice.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum KeyError {
    /// The run to leave is gone.
    #[error("this run is gone: r starts again")]
    RunGone,
    /// A knob of a node or a topic that the graph does not have.
    #[error("there is no {what} {target:?}: expected {known}")]
    UnknownTarget {
        /// Node or topic.
        what: &'static str,
        /// The name in the knob.
        target: String,
        /// The names in the graph.
        known: String,
    },
    /// No ticks overlap where the key looks for some.
    #[error("no ticks {0}")]
    NoOverlap(&'static str),
    /// The recorded run is executed again, and has come to this run time.
    #[error("executing the run again: {0}")]
    Executing(Time),
    /// The graph or the system refuses it, with this reason.
    #[error("{0}")]
    Refused(String),
}

impl KeyError {
    /// Creates a refusal by the graph or the system.
    pub fn refused(reason: impl ToString) -> Self {
        Self::Refused(reason.to_string())
    }
}

//! Why what a key asked for is not done.

use ratelab::Time;
use thiserror::Error;

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

//! What is different when a log is executed again.

use ratelab::journal::{End, Entry};
use thiserror::Error;

/// A difference from the recorded run.
#[derive(Clone, Debug, Error)]
pub enum PlayError {
    /// A node ended the run, in these words.
    #[error("{0}; the recorded run went on")]
    Ended(String),
    /// The run has not come to its recorded end.
    #[error("it did not come to its recorded end, {0:?}")]
    OtherEnd(End),
    /// A thread that had ended goes on.
    #[error("it had ended before")]
    HadEnded,
    /// A node without a thread.
    #[error("it has no thread, and had one")]
    NoThread,
    /// A command for a node that does not exist.
    #[error("it has no such node")]
    NoNode,
    /// An entry that no thread writes.
    #[error("no thread can have done {0:?}")]
    Impossible(Entry),
    /// Another node had something to do.
    #[error("{now} had something to do where {before} had in the recorded run")]
    OtherNode {
        /// The node of this run.
        now: String,
        /// The node of the recorded run.
        before: String,
    },
}

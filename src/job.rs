//! What a node is to do.

use std::time::Duration;

/// What a node is to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Job {
    /// The node.
    pub member: usize,
    /// What it is to do.
    pub kind: JobKind,
}

/// The kinds of work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JobKind {
    /// A whole tick.
    Tick {
        /// Lateness of its start, if it is known.
        lateness: Option<Duration>,
        /// Duration, if it is set.
        cost: Option<Duration>,
    },
    /// The begin of a tick that takes run time: its messages are held back.
    Begin {
        /// Lateness of its start, if it is known.
        lateness: Option<Duration>,
        /// Duration.
        takes: Duration,
        /// Whether it keeps a core busy under the real clock.
        busy: bool,
    },
    /// The end of that tick: its messages are published.
    End,
    /// Nothing: messages were taken that are not yet the inputs of a tick.
    Take,
}

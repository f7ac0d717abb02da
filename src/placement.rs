//! Where a node ticks.

/// Where a node ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Placement {
    /// On a thread of its own.
    #[default]
    Thread,
    /// The same, with its outputs at the end of the period.
    Let,
    /// On the threads of an executor.
    Executor {
        /// Number of the executor in the graph.
        index: usize,
        /// Whether due times of timers wait in line there.
        queues: bool,
    },
}

impl Placement {
    /// Number of the executor whose threads it shares.
    pub(crate) fn executor(self) -> Option<usize> {
        match self {
            Self::Executor { index, .. } => Some(index),
            Self::Thread | Self::Let => None,
        }
    }
}

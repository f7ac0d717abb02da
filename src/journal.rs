//! What the threads of a real clock did, for another execution of the run.
//!
//! A graph keeps none of it: it hands each entry to its [`Journal`], if it has one.

use std::{any::Any, time::Duration};

use super::{
    sync::Arc,
    time::Time,
    turns::{Noter, Operation},
};

/// Keeps the entries of the threads of a run: the one that supervises is number 0, then come the
/// nodes in the order of their addition.
pub trait Journal: Any + Send + Sync {
    /// Threads start, for so many `nodes`.
    fn begin(&self, nodes: usize);

    /// The entries of thread number `thread`.
    fn thread(&self, thread: usize) -> Arc<dyn ThreadJournal>;
}

/// Keeps the entries of one thread, in order.
pub trait ThreadJournal: Send + Sync {
    /// Adds an entry, with the turns that the thread took meanwhile.
    fn add(&self, entry: &Entry, turns: &[Operation]);
}

/// What a thread did between two waits, as far as it is not a result of what it read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Entry {
    /// Threads start. This is in the journal of every thread.
    Begin,
    /// A node ticked.
    Tick {
        /// Start.
        began: Time,
        /// Duration.
        took: Duration,
        /// Ticks due before this are missed.
        passed: Time,
    },
    /// A node took messages that are not yet the inputs of a tick.
    Look {
        /// Run time.
        at: Time,
    },
    /// An executor called a node for a message of one of the topics that trigger it: what it
    /// takes next is of that topic.
    Choose {
        /// Run time.
        at: Time,
        /// Number of the topic.
        input: usize,
    },
    /// A node began a tick with a configured duration.
    Start {
        /// Start.
        began: Time,
    },
    /// A node ended such a tick.
    Finish {
        /// End.
        ended: Time,
        /// Ticks due before this are missed.
        passed: Time,
    },
    /// A command took effect or was refused.
    Obey {
        /// Run time.
        at: Time,
        /// Position in the event log.
        event: u64,
    },
    /// A node ended its thread: ticks due before this are missed.
    Leave {
        /// Run time.
        before: Time,
    },
    /// All threads have ended.
    End(End),
    /// A command was carried out during a pause.
    Rest {
        /// Position in the event log.
        event: u64,
    },
    /// Nobody was left to end a pause.
    Abandoned,
}

/// How the threads of a stretch came to their end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// A pause.
    Paused,
    /// The end of the run time.
    Completed {
        /// Run time.
        until: Time,
    },
    /// A node ended the run.
    Ended {
        /// Index of the node.
        node: usize,
        /// Run time.
        at: Time,
    },
    /// A command stopped the run.
    Stopped,
    /// On to the virtual clock.
    HandedOver,
    /// A node failed.
    Failed {
        /// Index of the node.
        node: usize,
        /// Run time.
        at: Time,
    },
    /// A node had no thread: the system refused one.
    NoThread {
        /// Index of the node.
        node: usize,
        /// Run time.
        at: Time,
    },
    /// A branch left the recorded run at a rest between two ticks.
    Left,
}

impl Entry {
    /// Run time of the entry, of those that have one.
    pub fn at(&self) -> Option<Time> {
        match self {
            Self::Tick { began: at, .. }
            | Self::Look { at }
            | Self::Choose { at, .. }
            | Self::Start { began: at }
            | Self::Finish { ended: at, .. }
            | Self::Obey { at, .. } => Some(*at),
            Self::Begin | Self::Leave { .. } | Self::End(_) | Self::Rest { .. } => None,
            Self::Abandoned => None,
        }
    }
}

/// The way of a thread's entries to the journal, if the run has one.
#[derive(Clone)]
pub struct Entries(Option<Arc<dyn ThreadJournal>>);

impl Entries {
    pub(crate) fn new(journal: Option<Arc<dyn ThreadJournal>>) -> Self {
        Self(journal)
    }

    /// Adds an entry of this thread, with the operations that it noted since its last one.
    pub(crate) fn note(&self, entry: Entry) {
        if let Some(journal) = &self.0 {
            Noter::take(|turns| journal.add(&entry, turns));
        }
    }

    /// Adds an entry of a thread without operations.
    pub fn note_alone(&self, entry: Entry) {
        self.add(&entry, &[]);
    }

    /// Adds an entry of this thread with its operations.
    pub fn add(&self, entry: &Entry, turns: &[Operation]) {
        if let Some(journal) = &self.0 {
            journal.add(entry, turns);
        }
    }

    /// Has the calling thread note its turns for this journal, while the result lives.
    pub(crate) fn noter(&self) -> Option<Noter> {
        self.0.as_ref().map(|_| Noter::new())
    }
}

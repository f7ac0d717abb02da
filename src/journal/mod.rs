//! What the threads of a real clock did, for another execution of the run.
//!
//! A graph keeps none of it: it hands each entry to its [`Journal`].

pub(crate) mod turns;

use std::any::Any;

use serde::{Deserialize, Serialize};

pub use self::turns::{Following, LockName, Noter, Operation, TurnFollower};

use crate::{arrival::Arrival, sync::Arc, time::Time};

/// Keeps the entries of the threads of a run: the one that supervises is number 0; a thread of a
/// task set has the number of one of its nodes, which count from 1 in the order of their addition.
pub trait Journal: Any + Send + Sync {
    /// Threads start, for so many `nodes`.
    fn begin(&self, nodes: usize);

    /// Returns the entries of thread number `thread`.
    fn thread(&self, thread: usize) -> Arc<dyn ThreadJournal>;
}

/// Keeps the entries of one thread, in order.
pub trait ThreadJournal: Send + Sync {
    /// Adds an entry, with the turns that the thread took meanwhile.
    fn add(&self, entry: &Entry, turns: &[Operation]);
}

/// What a thread of a task set did between two waits, as far as it does not follow from what it
/// read: what its clock answered, and what reached it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Entry {
    /// Threads start. This is in the journal of every thread.
    #[default]
    Begin,
    /// It heard that a message arrives for a node.
    Arrive(Arrival),
    /// It looked for work, and did it.
    Look {
        /// Run time.
        at: Time,
        /// The end of the run, where that had passed.
        late: Option<AfterEnd>,
        /// Index of the node that began a tick, or ended one.
        node: Option<usize>,
    },
    /// It ended the tick of a node that has had its time on a core.
    Finish {
        /// Run time.
        at: Time,
        /// Index of the node.
        node: usize,
    },
    /// The work of its last look was over.
    Done {
        /// Run time.
        at: Time,
        /// Ticks due before this are missed.
        missed_before: Time,
    },
    /// A command took effect or was refused.
    Obey {
        /// Run time.
        at: Time,
        /// Position in the event log.
        event: u64,
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

/// A look after the end of the run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct AfterEnd {
    /// The end of the run.
    pub until: Time,
    /// Whether executors choose nothing more: only nodes tick that were due before.
    pub over: bool,
}

/// How the threads of a stretch came to their end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
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
    /// Returns the run time of the entry; `None` for an entry without a time.
    pub fn at(&self) -> Option<Time> {
        match self {
            Self::Look { at, .. }
            | Self::Finish { at, .. }
            | Self::Done { at, .. }
            | Self::Obey { at, .. } => Some(*at),
            Self::Begin | Self::Arrive(_) | Self::End(_) => None,
            Self::Rest { .. } | Self::Abandoned => None,
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
    pub fn note(&self, entry: Entry) {
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

    /// Notes the turns of the calling thread for this journal, while the result lives.
    pub fn noter(&self) -> Option<Noter> {
        self.0.as_ref().map(|_| Noter::new())
    }
}

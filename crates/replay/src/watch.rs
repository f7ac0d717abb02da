//! Watches a run that is executed again.

use std::{
    hash::{BuildHasher, RandomState},
    time::Duration,
};

use ratelab::{
    Time,
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, AtomicU64, Ordering},
        lock, thread,
    },
};

use super::hold::Hold;

/// Longest pause of a thread before an operation that is to be perturbed.
const LONGEST_PAUSE_US: u64 = 100;

/// A run that is executed again, as seen from other threads: its first difference from the
/// recorded one, and what it is doing.
#[derive(Debug)]
pub struct Watch {
    over: AtomicBool,
    difference: Mutex<Option<String>>,
    perturbed: AtomicBool,
    hold: Hold,
    /// Entries that are finished.
    finished: AtomicU64,
    threads: Vec<SeenThread>,
}

/// A thread of the run.
#[derive(Debug)]
struct SeenThread {
    name: Arc<str>,
    /// Run time of the entry that it is in, plus one; zero between entries.
    in_entry: AtomicU64,
    /// How long that entry took when it was recorded (ns).
    took: AtomicU64,
    /// Whether it waits for its turn.
    waits: AtomicBool,
}

/// What a run does at a moment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Doing {
    /// Number of ticks and commands that are over.
    pub finished: u64,
    /// The node that all others wait for, if one is in a tick.
    pub node: Option<BusyNode>,
}

/// A node in a tick.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BusyNode {
    /// Its name.
    pub name: Arc<str>,
    /// Run time at which the tick began.
    pub at: Time,
    /// How long the tick took in the recorded run.
    pub took: Duration,
}

impl Watch {
    /// Watches the threads with these `names`.
    pub(crate) fn new(names: impl IntoIterator<Item = Arc<str>>) -> Self {
        let threads = names.into_iter().map(|name| SeenThread {
            name,
            in_entry: AtomicU64::new(0),
            took: AtomicU64::new(0),
            waits: AtomicBool::new(false),
        });
        Self {
            over: AtomicBool::new(false),
            difference: Mutex::default(),
            perturbed: AtomicBool::new(false),
            hold: Hold::default(),
            finished: AtomicU64::new(0),
            threads: threads.collect(),
        }
    }

    /// The first operation that was not the recorded one; `None` if there is none.
    pub fn difference(&self) -> Option<String> {
        lock(&self.difference).clone()
    }

    /// What the run does now.
    pub fn doing(&self) -> Doing {
        // The supervisor is no node.
        let node = self.threads.iter().skip(1).find_map(|seen| {
            let at = seen.in_entry.load(Ordering::Acquire).checked_sub(1)?;
            let waits = seen.waits.load(Ordering::Relaxed);
            (!waits).then(|| BusyNode {
                name: seen.name.clone(),
                at: Time::from_nanos(at),
                took: Duration::from_nanos(seen.took.load(Ordering::Relaxed)),
            })
        });
        Doing {
            finished: self.finished.load(Ordering::Relaxed),
            node,
        }
    }

    /// Allows the first `operations` of the overlap in which the run is [held](crate::Rerun::hold).
    pub fn allow(&self, operations: usize) {
        self.hold.allow(operations);
    }

    /// The number of operations of that overlap that are done, once its nodes are at rest.
    pub fn held(&self) -> Option<usize> {
        self.hold.done()
    }

    /// Ends a run that is held.
    pub fn end(&self) {
        self.over.store(true, Ordering::Release);
        self.hold.end();
    }

    pub(crate) fn hold(&self) -> &Hold {
        &self.hold
    }

    /// Gives up: this is not the recorded run. The first reason counts.
    pub(crate) fn differs(&self, reason: String) {
        lock(&self.difference).get_or_insert(reason);
        self.over.store(true, Ordering::Release);
        self.hold.let_go();
    }

    /// Whether the run was given up.
    pub(crate) fn is_over(&self) -> bool {
        self.over.load(Ordering::Acquire)
    }

    /// Has every thread pause for a random time before each operation.
    pub(crate) fn set_perturbed(&self) {
        self.perturbed.store(true, Ordering::Relaxed);
    }

    pub(crate) fn is_perturbed(&self) -> bool {
        self.perturbed.load(Ordering::Relaxed)
    }

    pub(super) fn perturb(&self) {
        if self.is_perturbed() {
            let random = RandomState::new().hash_one(0) % LONGEST_PAUSE_US;
            thread::sleep(Duration::from_micros(random));
        }
    }

    pub(crate) fn name(&self, thread: usize) -> &str {
        &self.threads[thread].name
    }

    /// Notes that a thread began an entry at run time `at`, which `took` so long in the
    /// recorded run.
    pub(crate) fn begins(&self, thread: usize, at: Time, took: Duration) {
        let (seen, took) = (&self.threads[thread], took.as_nanos() as u64);
        seen.took.store(took, Ordering::Relaxed);
        let at = at.as_nanos().saturating_add(1);
        seen.in_entry.store(at, Ordering::Release);
    }

    /// Notes that a thread finished its entry.
    pub(crate) fn finishes(&self, thread: usize) {
        self.threads[thread].in_entry.store(0, Ordering::Relaxed);
        self.finished.fetch_add(1, Ordering::Relaxed);
    }

    pub(super) fn waits(&self, thread: usize, waits: bool) {
        self.threads[thread].waits.store(waits, Ordering::Relaxed);
    }
}

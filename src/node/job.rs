//! What a node is to do, and how long its last tick took.

use std::time::Duration;

use crate::{
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    time::Time,
};

/// What a node is to do. It has the size of two words, because it is handed from function to
/// function in every tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Job {
    lateness: u64,
    member: u32,
    /// What it is to do.
    pub(crate) kind: JobKind,
}

/// The kinds of jobs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JobKind {
    /// A whole tick.
    Tick {
        /// Whether its duration is set, and is zero.
        is_instant: bool,
    },
    /// The begin of a tick that takes run time: its messages are held back.
    Begin,
    /// The end of that tick: its messages are published.
    End,
}

impl Job {
    /// An unknown lateness.
    const UNKNOWN: u64 = u64::MAX;

    /// Creates a job for this member of a task set.
    pub(crate) fn new(member: usize, kind: JobKind) -> Self {
        Self {
            lateness: Self::UNKNOWN,
            member: member as u32,
            kind,
        }
    }

    /// Sets how late its tick begins, if that is known.
    #[must_use]
    pub(crate) fn with_lateness(self, lateness: Option<Duration>) -> Self {
        let nanos = lateness.map(|late| u64::try_from(late.as_nanos()).unwrap_or(u64::MAX - 1));
        Self {
            lateness: nanos.unwrap_or(Self::UNKNOWN),
            ..self
        }
    }

    /// Returns the node, by its number in the task set.
    pub(crate) fn member(self) -> usize {
        self.member as usize
    }

    /// Lateness of its start, if it is known.
    pub(crate) fn lateness(self) -> Option<Duration> {
        (self.lateness != Self::UNKNOWN).then(|| Duration::from_nanos(self.lateness))
    }
}

/// When a job was done.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WorkTimes {
    /// Run time of its begin and its end.
    pub(crate) began: Time,
    pub(crate) ended: Time,
    /// Ticks due before this are missed: their periods passed meanwhile.
    pub(crate) missed_before: Time,
    /// Its duration, if that was measured.
    pub(crate) took: Option<Duration>,
}

/// Tells a node how long its last tick took, in run time: what it is set to take, or under
/// the real clock what it took; see [`Wiring::last_tick`](crate::Wiring::last_tick). A run
/// that is executed again has the same durations.
#[derive(Clone, Debug)]
pub struct LastTick(Arc<AtomicU64>);

impl LastTick {
    /// No tick is over.
    const NONE: u64 = u64::MAX;

    pub(crate) fn new() -> Self {
        Self(Arc::new(AtomicU64::new(Self::NONE)))
    }

    pub(crate) fn set(&self, took: Duration) {
        let nanos = u64::try_from(took.as_nanos()).unwrap_or(Self::NONE - 1);
        self.0.store(nanos, Ordering::Relaxed);
    }

    /// Returns the duration of the tick that was over since the last call, if one was.
    pub fn take(&self) -> Option<Duration> {
        let nanos = self.0.swap(Self::NONE, Ordering::Relaxed);
        (nanos != Self::NONE).then(|| Duration::from_nanos(nanos))
    }
}

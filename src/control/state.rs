//! The state of a run, read from any thread while it goes on.

use std::{fmt, sync::OnceLock};

use super::{
    command::{ClockKind, Speed},
    event::Event,
};
use crate::{
    journal::Journal,
    shared::Shared,
    sync::{
        Arc, Instant, Mutex,
        atomic::{AtomicBool, AtomicU64, Ordering},
        lock,
    },
    time::Time,
};

/// The state of a graph's clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Status {
    /// The current clock, or the last one.
    pub clock: ClockKind,
    /// Whether a command has paused run time.
    pub paused: bool,
    /// Speed of the virtual clock.
    pub speed: Speed,
}

/// State of a run: read from any thread without slowing it. Its clock writes it with a
/// [`RunWriter`](crate::clock::RunWriter).
///
/// ```
/// use std::thread;
/// use ratelab::{Clock, Graph, Hz, Inbox, Tick, Time, VirtualClock};
///
/// let mut graph = Graph::new();
/// graph.node("camera", Hz::new(30.0)?, 0, |_| |_: &mut Tick| {})?;
/// let (state, end) = (graph.state(), Time::from_secs_f64(100.0)?);
/// thread::scope(|scope| {
///     scope.spawn(|| {
///         while state.now() < end {
///             thread::yield_now();
///         }
///     });
///     VirtualClock.run(&mut graph, &mut Inbox::default(), end)
/// })?;
/// assert!(state.events(0).is_empty());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct RunState {
    pub(super) now: AtomicU64,
    pub(super) status: Mutex<Status>,
    /// In turns, because its order is part of the run. Only rare events lock it, never a tick.
    pub(super) events: Shared<Vec<Event>>,
    /// Keeps what the threads of the real clock do, if anybody wants that.
    pub(super) journal: OnceLock<Arc<dyn Journal>>,
    /// The moment of run time zero, while a real clock runs the graph.
    pub(super) zero: Mutex<Option<Instant>>,
    /// Whether run time may wait for observers.
    pub(super) waits: AtomicBool,
}

impl RunState {
    /// Returns the run time of the last tick or command.
    pub fn now(&self) -> Time {
        Time::from_nanos(self.now.load(Ordering::Relaxed))
    }

    /// Returns the state of the graph's clock.
    pub fn status(&self) -> Status {
        *lock(&self.status)
    }

    /// Returns the moment of run time zero under the real clock; `None` in virtual time, before
    /// the run and during a pause.
    pub fn zero(&self) -> Option<Instant> {
        *lock(&self.zero)
    }

    /// Returns whether run time may wait for observers: wall time must not, but virtual time may.
    pub fn waits(&self) -> bool {
        self.waits.load(Ordering::Relaxed)
    }

    /// Commands, ends and presences of other processes so far, starting with number `first`.
    pub fn events(&self, first: usize) -> Vec<Event> {
        self.events.peek().iter().skip(first).cloned().collect()
    }

    /// Returns the journal of the run; if it has none, what `make` returns from now on.
    pub fn journal_or(&self, make: impl FnOnce() -> Arc<dyn Journal>) -> Arc<dyn Journal> {
        self.journal.get_or_init(make).clone()
    }
}

impl fmt::Debug for RunState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("RunState").finish_non_exhaustive()
    }
}

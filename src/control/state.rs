//! The state of a run, read from any thread while it goes on.

use std::{fmt, sync::OnceLock};

use super::{
    command::{ClockKind, Command, Speed},
    event::{Event, EventKind},
    knob::Knob,
    refusal::KnobRefusal,
};
use crate::{
    journal::{Entries, Journal},
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

/// State of a run: written by its clock, read from any thread without slowing it.
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
    now: AtomicU64,
    status: Mutex<Status>,
    /// In turns, because its order is part of the run. Only rare events lock it, never a tick.
    events: Shared<Vec<Event>>,
    /// Keeps what the threads of the real clock do, if anybody wants that.
    journal: OnceLock<Arc<dyn Journal>>,
    /// The moment of run time zero, while a real clock runs the graph.
    zero: Mutex<Option<Instant>>,
    /// Whether run time may wait for observers.
    waits: AtomicBool,
}

impl RunState {
    /// A run at its beginning.
    pub fn new(status: Status) -> Self {
        Self {
            now: AtomicU64::new(0),
            status: Mutex::new(status),
            events: Shared::new("the event log", Vec::new()),
            journal: OnceLock::new(),
            zero: Mutex::new(None),
            waits: AtomicBool::new(false),
        }
    }

    /// Run time of the last tick or command.
    pub fn now(&self) -> Time {
        Time::from_nanos(self.now.load(Ordering::Relaxed))
    }

    /// Sets run time to `now`.
    pub fn set_now(&self, now: Time) {
        self.now.store(now.as_nanos(), Ordering::Relaxed);
    }

    /// Advances run time to at least `now`.
    pub fn advance_to(&self, now: Time) {
        self.now.fetch_max(now.as_nanos(), Ordering::Relaxed);
    }

    /// The state of the graph's clock.
    pub fn status(&self) -> Status {
        *lock(&self.status)
    }

    /// Changes the state of the clock.
    pub fn update(&self, change: impl FnOnce(&mut Status)) {
        change(&mut lock(&self.status));
    }

    /// The moment of run time zero under the real clock; `None` in virtual time, before
    /// the run and during a pause.
    pub fn zero(&self) -> Option<Instant> {
        *lock(&self.zero)
    }

    /// Sets the wall time of run time zero.
    pub fn set_zero(&self, zero: Option<Instant>) {
        *lock(&self.zero) = zero;
    }

    /// Whether run time may wait for observers: wall time must not, but virtual time may.
    pub fn waits(&self) -> bool {
        self.waits.load(Ordering::Relaxed)
    }

    /// Sets whether run time may wait for observers.
    pub fn set_waits(&self, waits: bool) {
        self.waits.store(waits, Ordering::Relaxed);
    }
}

/// Its events.
impl RunState {
    /// Commands, ends and presences of other processes so far, starting with number `first`.
    pub fn events(&self, first: usize) -> Vec<Event> {
        self.events.peek().iter().skip(first).cloned().collect()
    }

    /// Adds an event; returns its position.
    pub fn note(&self, at: Time, what: EventKind) -> usize {
        let mut events = self.events.lock();
        events.push(Event { at, what });
        events.len() - 1
    }

    /// Logs that a node in another process appeared or fell silent.
    pub fn note_presence(&self, at: Time, node: &str, present: bool, what: &str) {
        let (node, what) = (node.to_owned(), what.to_owned());
        let presence = EventKind::Presence {
            node,
            present,
            what,
        };
        self.note(at, presence);
    }

    pub(crate) fn log_applied(&self, at: Time, command: &Command, was: Option<String>) -> usize {
        let command = command.clone();
        self.note(at, EventKind::Applied { command, was })
    }

    /// Logs that `command` was refused; returns the position of the event.
    pub fn log_refused(&self, at: Time, command: &Command, reason: impl Into<String>) -> usize {
        let (command, reason) = (command.clone(), reason.into());
        self.note(at, EventKind::Refused { command, reason })
    }

    /// Logs a node's answer to `command`: the replaced value, or the reason for its
    /// refusal.
    pub(crate) fn log_answered(
        &self,
        at: Time,
        command: &Command,
        answer: Result<Option<Knob>, KnobRefusal>,
    ) -> usize {
        match answer {
            Ok(before) => self.log_applied(at, command, command.replaced(before.as_ref())),
            Err(reason) => self.log_refused(at, command, reason.to_string()),
        }
    }
}

/// Its journal.
impl RunState {
    /// The journal of the run; if it has none, what `make` returns from now on.
    pub fn journal_or(&self, make: impl FnOnce() -> Arc<dyn Journal>) -> Arc<dyn Journal> {
        self.journal.get_or_init(make).clone()
    }

    /// Begins a stretch of threads, for so many `nodes` and for what supervises them.
    pub fn begin_threads(&self, nodes: usize) {
        if let Some(journal) = self.journal.get() {
            journal.begin(nodes);
        }
    }

    /// The entries of thread number `thread`: that which supervises, then the nodes.
    pub fn entries_of(&self, thread: usize) -> Entries {
        let journal = self.journal.get();
        Entries::new(journal.map(|journal| journal.thread(thread)))
    }
}

impl fmt::Debug for RunState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("RunState").finish_non_exhaustive()
    }
}

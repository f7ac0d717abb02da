//! The writing end of a run's state.

use std::{ops::Deref, sync::OnceLock};

use super::{
    command::Command,
    event::{Event, EventKind},
    knob::Knob,
    refusal::KnobRefusal,
    state::{RunState, Status},
};
use crate::{
    journal::Entries,
    shared::Shared,
    sync::{
        Arc, Instant, Mutex,
        atomic::{AtomicBool, AtomicU64, Ordering},
        lock,
    },
    time::Time,
};

/// Writes the state of a run: for its clock, and for what hears of nodes in other processes.
#[derive(Clone, Debug)]
pub struct RunWriter(Arc<RunState>);

impl Deref for RunWriter {
    type Target = RunState;

    fn deref(&self) -> &RunState {
        &self.0
    }
}

impl RunWriter {
    /// Creates a run at its beginning.
    pub fn new(status: Status) -> Self {
        Self(Arc::new(RunState {
            now: AtomicU64::new(0),
            status: Mutex::new(status),
            events: Shared::new("the event log", Vec::new()),
            journal: OnceLock::new(),
            zero: Mutex::new(None),
            waits: AtomicBool::new(false),
        }))
    }

    /// Returns the state, for readers.
    pub fn state(&self) -> Arc<RunState> {
        self.0.clone()
    }

    /// Sets run time to `now`.
    pub fn set_now(&self, now: Time) {
        self.now.store(now.as_nanos(), Ordering::Relaxed);
    }

    /// Advances run time to at least `now`.
    pub fn advance_to(&self, now: Time) {
        self.now.fetch_max(now.as_nanos(), Ordering::Relaxed);
    }

    /// Changes the state of the clock.
    pub fn update(&self, change: impl FnOnce(&mut Status)) {
        change(&mut lock(&self.status));
    }

    /// Sets the wall time of run time zero.
    pub fn set_zero(&self, zero: Option<Instant>) {
        *lock(&self.zero) = zero;
    }

    /// Sets whether run time may wait for observers.
    pub fn set_waits(&self, waits: bool) {
        self.waits.store(waits, Ordering::Relaxed);
    }
}

/// Its events.
impl RunWriter {
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
impl RunWriter {
    /// Begins a stretch of threads, for so many `nodes` and for what supervises them.
    pub fn begin_threads(&self, nodes: usize) {
        if let Some(journal) = self.journal.get() {
            journal.begin(nodes);
        }
    }

    /// Returns the entries of thread number `thread`: that which supervises, then the nodes.
    pub fn entries_of(&self, thread: usize) -> Entries {
        let journal = self.journal.get();
        Entries::new(journal.map(|journal| journal.thread(thread)))
    }
}

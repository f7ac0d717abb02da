//! What is known of a run: its state, read from any thread while the run goes on and written by its
//! clock, and what happened in it beside ticks and messages.

use std::{fmt, ops::Deref, sync::OnceLock};

use serde::{Deserialize, Serialize};

use super::{
    command::{ClockKind, Command, KnobRefusal, Speed, TimedCommand},
    knob::{Knob, TimedKnob},
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

/// An event of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// Run time at which it took effect.
    pub at: Time,
    /// Kind of the event.
    pub what: EventKind,
}

/// The kinds of [`Event`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum EventKind {
    /// A command took effect.
    Applied {
        /// The command.
        command: Command,
        /// The value it replaced, as text, where it replaced one.
        was: Option<String>,
    },
    /// A command was refused.
    Refused {
        /// The command.
        command: Command,
        /// The reason and a remedy.
        reason: String,
    },
    /// A node ended the run.
    Ended {
        /// Name of the node.
        node: String,
    },
    /// A node failed.
    Faulted {
        /// Name of the node.
        node: String,
        /// The error.
        cause: String,
    },
    /// A node has crashed by itself, and the run goes on.
    Crashed {
        /// Name of the node.
        node: String,
        /// The reason and a remedy.
        cause: String,
    },
    /// A node in another process appeared, or fell silent.
    Presence {
        /// Name of the node.
        node: String,
        /// Whether its messages arrive.
        present: bool,
        /// The observation, such as `silent for 100 ms`.
        what: String,
    },
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", self.at)?;
        match &self.what {
            EventKind::Applied {
                command,
                was: Some(was),
            } => write!(f, "{command} (was {was})"),
            EventKind::Applied { command, was: None } => command.fmt(f),
            EventKind::Refused { command, reason } => write!(f, "{command} refused: {reason}"),
            EventKind::Ended { node } => write!(f, "{node} ended the run"),
            EventKind::Faulted { node, cause } => write!(f, "{node} failed: {cause}"),
            EventKind::Crashed { node, cause } => write!(f, "{node} crashed: {cause}"),
            EventKind::Presence { node, what, .. } => write!(f, "{node}: {what}"),
        }
    }
}

impl Event {
    /// Returns the command, if it took effect.
    pub fn applied(&self) -> Option<&Command> {
        match &self.what {
            EventKind::Applied { command, .. } => Some(command),
            _ => None,
        }
    }

    /// Returns the knob that was changed, with its time, if one was.
    pub fn knob(&self) -> Option<TimedKnob> {
        match self.applied()? {
            Command::Set(knob) => Some(TimedKnob {
                at: self.at,
                knob: knob.clone(),
            }),
            _ => None,
        }
    }

    /// Returns the knob that was set; for a node that crashed by itself, the crash of it.
    pub fn change(&self) -> Option<TimedKnob> {
        match &self.what {
            EventKind::Crashed { node, .. } => Some(TimedKnob {
                at: self.at,
                knob: Knob::Crash { node: node.clone() },
            }),
            _ => self.knob(),
        }
    }

    /// Returns the event as a command that repeats it, if it changed the result of the graph: a
    /// run on the virtual clock with the same configuration and these commands is the
    /// same run.
    pub fn replayable(&self) -> Option<TimedCommand> {
        match &self.what {
            EventKind::Applied { command, .. }
                if matches!(command, Command::Set(_) | Command::Stop) =>
            {
                Some(TimedCommand {
                    at: self.at,
                    command: command.clone(),
                })
            }
            _ => None,
        }
    }
}

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

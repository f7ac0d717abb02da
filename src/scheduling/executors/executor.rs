//! The kinds of executors, a row each, and an executor with its nodes.

use std::{fmt, str::FromStr};

use thiserror::Error;

use super::{
    events::EventOrder,
    ordered::{Callback, CallbackOrder},
    preemptive::{Preemptive, Urgency},
    windows::WindowOrder,
};
use crate::{scheduling::task::Task, settings::error::alternatives};

/// The most threads or cores of an executor.
const MAX_THREADS: usize = 1024;

/// The threads of an executor under the real clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Threads {
    /// So many, for all its nodes.
    Shared(usize),
    /// One for each node, which take turns on so many cores by their deadlines, or else by their
    /// priorities.
    Cores(usize),
}

/// A kind of executor.
pub struct ExecutorKind {
    name: &'static str,
    /// What the number after its name counts; `None` without a number.
    counts: Option<&'static str>,
    /// Whether its callbacks are as in ROS: in mutually exclusive groups, with timers that are
    /// due one period later for the first time.
    pub has_groups: bool,
    /// Whether it has a use for the deadlines of its nodes.
    pub has_deadlines: bool,
    /// Its threads under the real clock.
    threads: fn(usize) -> Threads,
    /// Makes its order of callbacks, for so many threads or cores; `None` if each node has a core
    /// of its own, for the whole of its period.
    pub(crate) order: Option<MakeOrder>,
}

type MakeOrder = fn(&[Callback], usize) -> Box<dyn CallbackOrder>;

/// One thread, as in ROS.
const SINGLE: ExecutorKind = ExecutorKind {
    name: "single",
    counts: None,
    has_groups: true,
    has_deadlines: false,
    threads: Threads::Shared,
    order: Some(|callbacks, threads| Box::new(WindowOrder::new(callbacks, threads))),
};

/// Virtual cores, by fixed priorities.
const FIXED_PRIORITY: ExecutorKind = ExecutorKind {
    name: "fixed-priority",
    counts: Some("CORES"),
    has_groups: false,
    has_deadlines: false,
    threads: Threads::Cores,
    order: Some(|nodes, cores| Box::new(Preemptive::new(Urgency::Priority, cores, nodes))),
};

/// All of them. Another one is a row here, with an order of callbacks in a file of its own.
static KINDS: [ExecutorKind; 6] = [
    SINGLE,
    ExecutorKind {
        name: "multi",
        counts: Some("THREADS"),
        ..SINGLE
    },
    ExecutorKind {
        name: "events",
        order: Some(|_, _| Box::<EventOrder>::default()),
        ..SINGLE
    },
    FIXED_PRIORITY,
    ExecutorKind {
        name: "edf",
        has_deadlines: true,
        order: Some(|nodes, cores| Box::new(Preemptive::new(Urgency::Deadline, cores, nodes))),
        ..FIXED_PRIORITY
    },
    ExecutorKind {
        name: "let",
        has_groups: false,
        order: None,
        ..SINGLE
    },
];

/// Decides which of the nodes that are due ticks next, and where. A node without an
/// executor has a thread of its own, always ready.
///
/// | text | | order |
/// |---|---|---|
/// | `single` | one thread, `rclcpp::executors::SingleThreadedExecutor` | by windows |
/// | `multi:N` | N threads, `rclcpp::executors::MultiThreadedExecutor` | by windows |
/// | `events` | one thread, `rclcpp::experimental::executors::EventsExecutor` | first in, first out |
/// | `fixed-priority:N` | N cores, preemptive | by the priority of the node, lowest number first |
/// | `edf:N` | N cores, preemptive | by the deadline, earliest first |
/// | `let` | a core for each node, logical execution time | reads when due, publishes at the end of the period |
///
/// The first three follow rclcpp 29.3.0 (`a0a2a06`) and rcl 9.2.0
/// (`c19dab5`). By windows: when nothing is ready any more, all that is ready by then is
/// looked up at once, and served in the order timers, subscriptions, each in the order of
/// registration, one message each (`executor.cpp:774-914`); what gets ready later waits
/// for the next look-up. (rclcpp promises no order within a kind since 28.0.1; here it is
/// the order of registration.) A timer is due one period after its start for the first
/// time (`timer.c:199`), and skips the instants that have passed when it is called, that of
/// the call included (`timer.c:298-319`): these are the overruns. A mutually exclusive
/// group runs one callback at a time: with several threads, a callback of a busy group
/// leaves the window, unless it is a timer (`executor.cpp:774-894`). The events executor
/// queues a timer when it is due and every message when it arrives
/// (`timers_manager.cpp:206-294`).
///
/// Preemptive executors follow the kernel of TrueTime (`63ae017`): jobs that are released
/// while the one before is unfinished queue up, with their release and deadline
/// (`ttkernel.cpp:323-344`), and of equals the first released runs. A job reads when it
/// begins and publishes when it is complete.
///
/// In virtual time all is exact: what happens at an instant happens before an executor
/// looks at it.
///
/// ```
/// use ratelab::Executor;
///
/// let multi: Executor = "multi:2".parse()?;
/// assert_eq!(multi.shares(), Some(2));
/// assert_eq!(
///     "multi".parse::<Executor>().unwrap_err().to_string(),
///     "\"multi\" is not an executor: expected single, multi:THREADS, events, \
///      fixed-priority:CORES, edf:CORES or let"
/// );
/// # Ok::<(), ratelab::ExecutorError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Executor {
    /// Place of its kind among all.
    kind: usize,
    /// Number of its threads or cores.
    pub(crate) number: usize,
}

impl Executor {
    /// Returns its kind.
    pub fn kind(&self) -> &'static ExecutorKind {
        &KINDS[self.kind]
    }

    /// Returns the number of the threads or cores that its nodes share; `None` if each has a core of
    /// its own.
    pub fn shares(&self) -> Option<usize> {
        self.kind().order.map(|_| self.number)
    }

    /// Returns its threads under the real clock.
    pub(crate) fn threads(&self) -> Threads {
        (self.kind().threads)(self.number)
    }

    /// Returns whether a node needs a period there, as this callback has it.
    pub fn needs_period(&self, callback: &Callback) -> bool {
        match self.kind().order {
            Some(_) => self.kind().has_deadlines && callback.deadline().is_none(),
            None => true,
        }
    }
}

impl fmt::Display for Executor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.kind().name)?;
        match self.kind().counts {
            Some(_) => write!(f, ":{}", self.number),
            None => Ok(()),
        }
    }
}

/// Returns the accepted texts.
fn expected() -> String {
    let forms = KINDS.iter().map(|kind| match kind.counts {
        Some(counts) => format!("{}:{counts}", kind.name),
        None => kind.name.to_owned(),
    });
    let forms: Vec<String> = forms.collect();
    format!("expected {}", alternatives(&forms))
}

impl FromStr for Executor {
    type Err = ExecutorError;

    fn from_str(text: &str) -> Result<Self, ExecutorError> {
        let refusal = |expected: String| ExecutorError {
            text: text.to_owned(),
            expected,
        };
        let (name, number) = match text.trim().split_once(':') {
            Some((name, number)) => (name, Some(number)),
            None => (text.trim(), None),
        };
        let is_it =
            |kind: &ExecutorKind| kind.name == name && kind.counts.is_some() == number.is_some();
        let kind = KINDS
            .iter()
            .position(is_it)
            .ok_or_else(|| refusal(expected()))?;
        let range = || refusal(format!("expected {name}:N with N from 1 to {MAX_THREADS}"));
        let number = number
            .map_or(Some(1), |number| number.parse().ok())
            .filter(|number| (1..=MAX_THREADS).contains(number))
            .ok_or_else(range)?;
        Ok(Self { kind, number })
    }
}

/// A text that is not an executor.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{text:?} is not an executor: {expected}")]
pub struct ExecutorError {
    text: String,
    expected: String,
}

/// An executor with its nodes.
#[derive(Debug)]
pub(crate) struct Team {
    pub(crate) executor: Executor,
    /// The nodes in the order of registration.
    callbacks: Vec<Callback>,
}

impl Team {
    pub(crate) fn new(executor: Executor, callbacks: Vec<Callback>) -> Self {
        Self {
            executor,
            callbacks,
        }
    }

    /// Returns the names of the nodes.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.callbacks.iter().map(|callback| &*callback.node)
    }

    /// Returns the name of the group that a member shares with others.
    pub(crate) fn group(&self, member: usize) -> Option<&str> {
        self.callbacks.get(member)?.group_name()
    }

    /// Returns what to do about a member without a period, if it needs one.
    pub(crate) fn period_remedy(&self, member: usize) -> Option<&'static str> {
        let callback = self.callbacks.get(member)?;
        self.executor.needs_period(callback).then(|| {
            if self.executor.kind().has_deadlines {
                "give it a deadline"
            } else {
                "give it a rate"
            }
        })
    }

    /// Returns the order of the callbacks of all its nodes; `None` if each has a core of its own.
    pub(crate) fn order(&self) -> Option<Box<dyn CallbackOrder>> {
        let order = self.executor.kind().order?;
        Some(order(&self.callbacks, self.executor.number))
    }

    /// Returns the order for each of these nodes alone, on a core of its own.
    pub(crate) fn orders_apart(
        &self,
        tasks: Vec<Task>,
    ) -> impl Iterator<Item = (Task, Box<dyn CallbackOrder>)> {
        let order = self.executor.kind().order;
        tasks
            .into_iter()
            .zip(&self.callbacks)
            .filter_map(move |(task, callback)| {
                Some((task, order?(std::slice::from_ref(callback), 1)))
            })
    }
}

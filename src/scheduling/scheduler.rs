//! What an executor is: it decides which of its nodes ticks next.

use std::time::Duration;

use super::agenda::{Agenda, Phase};
use crate::{command::ClockKind, task::Task, time::Time};

/// Decides which released callback is called now. It owns no node and waits for nothing, so the
/// same one serves both clocks. Its nodes are known by their number in the order of
/// registration.
pub trait Scheduler: Send {
    /// The timer of a node is due.
    fn due(&mut self, member: usize, plan: &mut AtInstant<'_>);

    /// A message has arrived for a node.
    fn arrived(&mut self, member: usize, input: usize, plan: &mut AtInstant<'_>);

    /// The callback to call now, if there are one and a thread for it.
    fn next(&mut self, plan: &mut AtInstant<'_>) -> Option<Call>;

    /// A callback was called, and its node ticks until `ends`.
    fn began(&mut self, member: usize, ends: Time, plan: &mut AtInstant<'_>);

    /// A callback was called and is over.
    fn ended(&mut self, member: usize, plan: &mut AtInstant<'_>);

    /// Takes a node over as it is after a change of the clock, but for its messages.
    fn take_over(&mut self, member: usize, plan: &mut AtInstant<'_>);

    /// Forgets what is due or runs of a node that crashed.
    fn forget(&mut self, member: usize);

    /// Forgets that the timer of a node is due, if the call would have set its next due
    /// time: that has changed.
    fn reschedule(&mut self, member: usize);
}

/// A callback to be called now, with the index of its node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Call {
    /// The timer of a node.
    Timer {
        /// Index of the node.
        node: usize,
    },
    /// One of its subscriptions, for one message.
    Message {
        /// Index of the node.
        node: usize,
        /// Number of the topic among those that trigger it.
        input: usize,
    },
    /// Its subscriptions in turn, until a set of messages is complete.
    Messages {
        /// Index of the node.
        node: usize,
    },
}

impl Call {
    /// Index of the node.
    pub(super) fn node(self) -> usize {
        match self {
            Self::Timer { node } | Self::Message { node, .. } | Self::Messages { node } => node,
        }
    }
}

/// The run at an instant, as a scheduler sees it.
pub struct AtInstant<'a> {
    pub(super) now: Time,
    pub(super) clock: ClockKind,
    pub(super) tasks: &'a mut [Task],
    pub(super) agenda: &'a mut Agenda,
    /// The planned due time of each node's timer under an executor.
    pub(super) releases: &'a mut [Time],
}

impl AtInstant<'_> {
    /// Run time.
    pub fn now(&self) -> Time {
        self.now
    }

    /// The schedule of a node.
    pub fn task(&mut self, node: usize) -> &mut Task {
        &mut self.tasks[node]
    }

    /// The same, to look at.
    pub fn task_of(&self, node: usize) -> &Task {
        &self.tasks[node]
    }

    /// Whether a message of a topic that triggers a node waits for it. Under the real clock a
    /// look takes no turn: only what a node takes is in the log.
    pub fn waits(&self, node: usize, input: usize) -> bool {
        let task = &self.tasks[node];
        match self.clock {
            ClockKind::Virtual => task.oldest_of(input, self.now).is_some(),
            ClockKind::Real => task.waiting_in(input, self.now) > 0,
        }
    }

    /// Run time of the delivery of the oldest message that waits for a node; under the real
    /// clock now, if there is one.
    pub fn oldest(&self, node: usize) -> Option<Time> {
        let task = &self.tasks[node];
        match self.clock {
            ClockKind::Virtual => task.oldest(self.now),
            ClockKind::Real => {
                let mut inputs = 0..task.inputs();
                let waits = inputs.any(|input| self.waits(node, input));
                waits.then_some(self.now)
            }
        }
    }

    /// Plans the end of a node's tick.
    pub fn end_at(&mut self, node: usize, at: Time) {
        let rank = (self.tasks[node].priority, node);
        self.agenda.add(at, Phase::End, rank, node);
    }

    /// Plans the start of a tick on the node's own thread.
    pub(super) fn start_at(&mut self, node: usize, at: Time) {
        let rank = (self.tasks[node].priority, node);
        self.agenda.add(at, Phase::Start, rank, node);
    }

    /// Plans the due time of the timer of a node with this number in its executor.
    pub(super) fn release(&mut self, node: usize, member: usize) {
        let due = self.tasks[node].due();
        self.releases[node] = due;
        if due < Time::MAX {
            self.agenda.add(due, Phase::Release, (0, member), node);
        }
    }

    /// Has the messages arrive now that wait for a node.
    pub(super) fn add_waiting(&mut self, node: usize) {
        for input in 0..self.tasks[node].inputs() {
            for _ in 0..self.tasks[node].waiting_in(input, self.now) {
                self.agenda.add_arrival(self.now, node, input);
            }
        }
    }
}

/// Assignment for a node.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Assignment {
    /// Index of the node.
    pub(crate) node: usize,
    /// The topic whose message its executor called it for.
    pub(crate) input: Option<usize>,
    pub(crate) job: Job,
}

/// What a node is to do.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Job {
    /// A tick that takes no run time.
    Tick {
        /// Lateness, if it is known.
        lateness: Option<Duration>,
        /// Duration, if it is set.
        cost: Option<Duration>,
    },
    /// To begin a tick that takes run time.
    Start {
        /// Lateness, if it is known.
        lateness: Option<Duration>,
        /// Duration.
        takes: Duration,
    },
    /// To end it.
    Finish,
    /// Nothing: the messages taken are not yet the inputs of a tick.
    Look,
}

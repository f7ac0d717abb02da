//! What schedulers hear of, and what they can ask for.

use std::time::Duration;

use super::agenda::{Agenda, Phase};
use crate::{
    control::command::ClockKind,
    node::Job,
    record::{NodeRecord, RecordSender},
    settings::local_clock::{LocalClock, StampClock},
    sync::Arc,
    time::{Hz, Time},
};

/// What the scheduler of a task set hears of: a node with a thread of its own, or the nodes of an
/// executor.
///
/// A scheduler owns no node and waits for nothing. It hears of events, asks for alarms, and names the
/// next job: so the same one serves both clocks. Its nodes are its members, known by their number in
/// the order of registration.
///
/// | event | what it may do |
/// |---|---|
/// | `Opened` | ask for the alarms of all members; `anew`: look at what waits for them |
/// | `Alarm` | name a job, if it still waits for that time and phase |
/// | `Arrived` | note it, and ask for an alarm or a choice; messages are taken when a job is named |
/// | `Choose` | name a job: an executor chooses here, after all else of the instant |
/// | `Done` of a [`Tick`](crate::clock::JobKind::Tick) | ask for the alarm of the next one |
/// | `Done` of a [`Begin`](crate::clock::JobKind::Begin) | ask for an alarm at the end, and name [`End`](crate::clock::JobKind::End) then; with cores of its own the clock does that |
/// | `Done` of an `End` | as of a `Tick` |
/// | `Crashed`, `Restarted` | forget what it planned; begin anew |
/// | `Closed` | count due times that have passed during a tick |
///
/// Only `Alarm` and `Choose` are answered by a job. See `own.rs` for the simplest scheduler.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SchedulerEvent {
    /// A clock begins.
    Opened {
        /// Whether the nodes have run under another clock since, or not at all.
        anew: bool,
    },
    /// An alarm rings.
    Alarm {
        /// The node.
        member: usize,
        /// The time that it was asked for.
        at: Time,
        /// Its phase.
        phase: Phase,
    },
    /// A message has arrived on input number `input` of a node.
    Arrived {
        /// The node.
        member: usize,
        /// Number of the topic in the list of topics that trigger it.
        input: usize,
    },
    /// All else of this instant has happened; see [`Timetable::choose`].
    Choose,
    /// A job is done; a begin only without a fault.
    Done {
        /// The job.
        job: Job,
        /// Ticks due before this are missed.
        missed_before: Time,
    },
    /// A node has crashed: what it was to do is void.
    Crashed {
        /// The node.
        member: usize,
    },
    /// A node that had crashed begins again.
    Restarted {
        /// The node.
        member: usize,
    },
    /// A clock ends.
    Closed {
        /// Ticks due before this are missed.
        missed_before: Time,
    },
}

/// Where a node is in its schedule.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TaskState {
    /// Its rate; the lowest one for a node that messages trigger.
    pub(crate) hz: Hz,
    /// Due time of its next tick; [`Time::MAX`] if it has none.
    pub(crate) due: Time,
    /// Due time of the period before that.
    pub(crate) last_due: Option<Time>,
    /// Whether it ticks at a rate, on a thread of its own.
    pub(crate) has_own_timer: bool,
    /// Whether it has crashed.
    pub(crate) crashed: bool,
    /// Time on a core that the running tick still needs.
    pub(crate) remaining: Option<Duration>,
    /// Run time by which the running tick, or else the next one, is to be over, if that decides who
    /// gets a core.
    pub(crate) deadline: Option<Time>,
    /// Whether that tick keeps a core busy under the real clock.
    pub(crate) spins: bool,
}

/// A node as its scheduler knows it.
pub(crate) struct Member {
    /// Index in the graph.
    pub(crate) node: usize,
    pub(crate) name: Arc<str>,
    /// Number of the topics that trigger it.
    pub(crate) inputs: usize,
    pub(crate) priority: u32,
    /// Whether it runs in another process.
    pub(crate) remote: bool,
    pub(crate) records: RecordSender,
    pub(crate) clock: Arc<StampClock>,
}

/// What a scheduler can ask for, at an instant of the run.
pub(crate) struct Timetable<'a> {
    pub(super) now: Time,
    pub(super) clock: ClockKind,
    pub(super) over: bool,
    pub(super) members: &'a [Member],
    pub(super) agenda: &'a mut Agenda,
    pub(super) chooses: &'a mut bool,
}

impl Timetable<'_> {
    /// Returns the run time.
    #[inline]
    pub(crate) fn now(&self) -> Time {
        self.now
    }

    /// Returns the clock that runs the nodes.
    #[inline]
    pub(crate) fn clock(&self) -> ClockKind {
        self.clock
    }

    /// Returns whether the end of the run has passed, so that only nodes tick that were due before.
    pub(crate) fn is_over(&self) -> bool {
        self.over
    }

    /// Asks for an alarm of a node; none at [`Time::MAX`], and none for a node of another
    /// process. One for a time that has passed has its place in the order of this instant.
    #[inline]
    pub(crate) fn alarm(&mut self, at: Time, phase: Phase, member: usize) {
        let known = &self.members[member];
        if at == Time::MAX || known.remote {
            return;
        }
        let rank = match phase {
            Phase::End | Phase::Start => (known.priority, known.node),
            Phase::Timer => (0, member),
        };
        self.agenda.add(at, phase, rank, known.node);
    }

    /// Announces a message for a node, as if it had just been published.
    pub(crate) fn arrive(&mut self, member: usize, input: usize) {
        let known = &self.members[member];
        if !known.remote {
            self.agenda.add_arrival(self.now, known.node, input);
        }
    }

    /// Asks for one [`SchedulerEvent::Choose`] after all else of this instant.
    pub(crate) fn choose(&mut self) {
        *self.chooses = true;
    }

    /// Priority of a node: of nodes that are due together the one with the lowest number is
    /// first.
    pub(crate) fn priority(&self, member: usize) -> u32 {
        self.members[member].priority
    }

    /// Counts due times of a node that passed while it was busy.
    pub(crate) fn record_skipped(&self, member: usize, ticks: u64) {
        if ticks > 0 {
            self.record(member, NodeRecord::Skipped(ticks));
        }
    }

    /// Records another rate of a node.
    pub(crate) fn record_rate(&self, member: usize, hz: Hz) {
        self.record(member, NodeRecord::Rate(hz));
    }

    /// Stamps the messages of a node by a clock of its own from now on.
    pub(crate) fn stamp_by(&self, member: usize, clock: LocalClock) {
        self.members[member].clock.set(clock);
    }

    fn record(&self, member: usize, record: NodeRecord) {
        self.members[member].records.node(|| record);
    }
}

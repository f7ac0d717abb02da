//! When, and in which order, nodes run.

use std::{any::Any, time::Duration};

use super::agenda::{Agenda, Phase};
use crate::{
    control::{command::ClockKind, knob::Knob},
    node::{Job, StampClock, Stamps},
    record::{NodeRecord, RecordSender},
    sync::Arc,
    time::{Hz, Time},
};

/// Decides when the nodes of a task set run: a node with a thread of its own, or those of an
/// executor.
///
/// It owns no node and waits for nothing. It hears of events, asks for alarms, and names the
/// next job: so the same one serves both clocks. Its nodes are its members, known by their
/// number in the order of registration.
///
/// | event | what it may do |
/// |---|---|
/// | `Opened` | ask for the alarms of all members; `anew`: look at what waits for them |
/// | `Alarm` | name a job, if the time and the phase are still those that it waits for |
/// | `Arrived` | note it, and ask for an alarm or a choice; messages are taken when a job is named |
/// | `Choose` | name a job: an executor chooses here, after all else of the instant |
/// | `Done` of a [`Tick`](crate::JobKind::Tick) | ask for the alarm of the next one |
/// | `Done` of a [`Begin`](crate::JobKind::Begin) | ask for an alarm at the end, and name [`End`](crate::JobKind::End) then; with cores of its own the clock does that |
/// | `Done` of an `End` | as of a `Tick` |
/// | `Crashed`, `Restarted` | forget what it planned; begin anew |
/// | `Closed` | count due times that have passed during a tick |
///
/// Only `Alarm` and `Choose` are answered by a job. See `periodic.rs` for the simplest
/// one, and `crates/effects/src/nodes/own.rs` for one with triggers and ticks that take time.
pub trait Scheduler: Any + Send {
    /// Something has happened at `timetable.now()`; returns the job to be done now, if there is
    /// one.
    /// An alarm that is no longer of use does no harm.
    fn on(&mut self, event: SchedulerEvent, timetable: &mut Timetable<'_>) -> Option<Job>;

    /// Where a node is in its schedule at run time `now`.
    fn state(&self, member: usize, now: Time) -> TaskState;

    /// Checks that the schedule of a node has this knob, and that its value is complete.
    ///
    /// # Errors
    /// The reason, with a remedy.
    fn check(&self, member: usize, knob: &Knob) -> Result<(), String>;

    /// Sets a knob of a node's schedule that was checked; returns the value before.
    ///
    /// # Errors
    /// The reason, for a knob that it does not know.
    fn set(
        &mut self,
        member: usize,
        knob: &Knob,
        timetable: &mut Timetable<'_>,
    ) -> Result<String, String>;
}

/// What a scheduler hears of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SchedulerEvent {
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
        /// Number of the topic among those that trigger it.
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
pub struct TaskState {
    /// Its rate; the lowest one for a node that messages trigger.
    pub hz: Hz,
    /// Due time of its next tick; [`Time::MAX`] if it has none.
    pub due: Time,
    /// Due time of the period before that.
    pub last_due: Option<Time>,
    /// Whether ticks are skipped that are due while it is busy.
    pub skips: bool,
    /// Whether it has crashed.
    pub crashed: bool,
    /// Time on a core that the running tick still needs.
    pub remaining: Option<Duration>,
    /// Run time by which the running tick, or else the next one, is to be over, if that decides who
    /// gets a core.
    pub deadline: Option<Time>,
    /// Whether that tick keeps a core busy under the real clock.
    pub busy: bool,
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
pub struct Timetable<'a> {
    pub(super) now: Time,
    pub(super) clock: ClockKind,
    pub(super) over: bool,
    pub(super) members: &'a [Member],
    pub(super) agenda: &'a mut Agenda,
    pub(super) chooses: &'a mut bool,
}

impl Timetable<'_> {
    /// Run time.
    #[inline]
    pub fn now(&self) -> Time {
        self.now
    }

    /// The clock that runs the nodes.
    #[inline]
    pub fn clock(&self) -> ClockKind {
        self.clock
    }

    /// Whether the end of the run has passed, so that only those tick that were due before.
    pub fn is_over(&self) -> bool {
        self.over
    }

    /// Asks for an alarm of a node; none at [`Time::MAX`], and none for a node of another
    /// process. One for a time that has passed has its place in the order of this instant.
    #[inline]
    pub fn alarm(&mut self, at: Time, phase: Phase, member: usize) {
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

    /// Has a message arrive now for a node, as if it had just been published.
    pub fn arrive(&mut self, member: usize, input: usize) {
        let known = &self.members[member];
        if !known.remote {
            self.agenda.add_arrival(self.now, known.node, input);
        }
    }

    /// Asks for one [`SchedulerEvent::Choose`] after all else of this instant.
    pub fn choose(&mut self) {
        *self.chooses = true;
    }

    /// Priority of a node: of nodes that are due together the one with the lowest number is
    /// first.
    pub fn priority(&self, member: usize) -> u32 {
        self.members[member].priority
    }

    /// Counts due times of a node that passed while it was busy.
    pub fn skipped(&self, member: usize, ticks: u64) {
        if ticks > 0 {
            self.record(member, NodeRecord::Skipped(ticks));
        }
    }

    /// Records another rate of a node.
    pub fn rated(&self, member: usize, hz: Hz) {
        self.record(member, NodeRecord::Rate(hz));
    }

    /// Has the messages of a node stamped by a clock of its own from now on.
    pub fn stamp_by(&self, member: usize, stamps: Stamps) {
        self.members[member].clock.set(stamps);
    }

    fn record(&self, member: usize, record: NodeRecord) {
        self.members[member].records.node(|| record);
    }
}

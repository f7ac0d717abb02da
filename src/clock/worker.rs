//! A task set with a schedule of its own, and a thread of it: what it does for its nodes, at the
//! times that its clock knows. The real clock asks the wall; in a re-execution the log of the run
//! tells the times.

use std::time::Duration;

use crate::{
    arrival::Arrival,
    control::{
        command::{ClockKind, Command},
        state::RunWriter,
    },
    journal::AfterEnd,
    node::{Fault, Flow, JobKind, NodeSlot, TickResult, WorkTimes},
    scheduling::{Assignment, Schedule, TaskSet, executors::executor::Threads},
    shared::{Shared, SharedGuard},
    sync::{Mutex, lock},
    time::Time,
};

/// Where the nodes of an executor take turns by priority.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CoreClaim {
    /// Number of the executor, of all executors with cores.
    pub executor: usize,
    /// Number of its cores.
    pub cores: usize,
    /// Place of the node's priority within the executor, the highest first.
    pub rank: usize,
}

/// A task set with a schedule of its own.
pub(crate) struct SharedSchedule<'g> {
    schedule: Shared<Schedule>,
    /// The slots of all nodes of the graph.
    pub(crate) slots: &'g [Mutex<NodeSlot>],
    pub(crate) state: RunWriter,
    /// Index of the node that was registered first.
    pub(crate) first: usize,
    /// Number of threads; none if all nodes run in other processes.
    pub(crate) threads: usize,
    /// The cores that its thread shares with the threads of other nodes.
    pub(crate) claim: Option<CoreClaim>,
}

impl<'g> SharedSchedule<'g> {
    pub(crate) fn new(
        task_set: TaskSet,
        claim: Option<CoreClaim>,
        slots: &'g [Mutex<NodeSlot>],
        state: RunWriter,
    ) -> Self {
        let threads = match task_set.threads() {
            Some(Threads::Shared(threads)) => threads,
            _ => 1,
        };
        let here = task_set
            .members
            .iter()
            .filter(|member| !member.remote)
            .count();
        let first = task_set.members.first();
        let name = first.map_or("", |member| &*member.name);
        Self {
            // A node ticks once at a time: more threads would have nothing to do.
            threads: threads.min(here),
            claim,
            first: first.map_or(0, |member| member.node),
            slots,
            state,
            schedule: Shared::after(
                task_set.turns,
                format!("the executor of {name}"),
                Schedule::new(ClockKind::Real, vec![task_set]),
            ),
        }
    }

    /// Returns its task set, with the turns of its threads.
    pub(crate) fn into_task_set(self) -> Option<TaskSet> {
        let turns = self.schedule.turns();
        let task_set = self.schedule.peek().take_task_sets().pop()?;
        Some(TaskSet { turns, ..task_set })
    }

    /// Returns whether several threads share the schedule, in turns.
    pub(crate) fn is_shared(&self) -> bool {
        self.threads > 1
    }

    /// Returns the schedule, for a turn of a thread.
    pub(crate) fn turn(&self) -> SharedGuard<'_, Schedule> {
        if self.is_shared() {
            self.schedule.lock()
        } else {
            self.schedule.peek()
        }
    }

    /// Returns the schedule, for a look.
    pub(crate) fn peek(&self) -> SharedGuard<'_, Schedule> {
        self.schedule.peek()
    }
}

/// A node ended the run at this run time, or failed.
pub type Outcome = Option<Result<Time, Fault>>;

/// What a thread of a task set has to do with its nodes: it finds work, begins it, and is done with
/// it.
pub struct Worker<'c> {
    /// That of its task set.
    schedule: &'c SharedSchedule<'c>,
    /// The messages that it has heard of since its last look.
    arrivals: Vec<Arrival>,
    /// The work that it has found.
    found: Option<Assignment>,
    /// The work that is not yet over, with the run time of its begin.
    begun: Option<(Assignment, Time, TickResult)>,
}

/// What a look has found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LookResult {
    /// Index of the node that has work to do now.
    pub node: Option<usize>,
    /// Whether anything has happened.
    pub moved: bool,
}

/// Its work.
impl<'c> Worker<'c> {
    pub(super) fn new(schedule: &'c SharedSchedule<'c>) -> Self {
        Self {
            schedule,
            arrivals: Vec::new(),
            found: None,
            begun: None,
        }
    }

    /// Hears that a message arrives for a node of the task set. A damaged log may name any other.
    pub fn arrive(&mut self, arrival: Arrival) {
        if self.schedule.peek().hears(arrival) {
            self.arrivals.push(arrival);
        }
    }

    /// Looks for work at run time `at`.
    pub fn find(&mut self, at: Time, after: Option<AfterEnd>) -> LookResult {
        let mut schedule = self.schedule.turn();
        schedule.add_arrivals(self.arrivals.drain(..));
        self.found = schedule.next_job(at, after);
        LookResult {
            node: self.found.map(|work| work.node),
            moved: schedule.has_moved(),
        }
    }

    /// Finds the end of the running tick at run time `at`: the tick has had its time on a core.
    /// Returns the index of its node.
    pub fn find_end(&mut self, at: Time) -> Option<usize> {
        self.found = self.schedule.peek().end_job(self.schedule.first, at);
        self.found.map(|work| work.node)
    }

    /// Begins the work that was found, at run time `at`; returns its kind.
    pub fn begin(&mut self, at: Time) -> Option<JobKind> {
        let work = self.found.take()?;
        self.schedule.state.advance_to(at);
        let outcome = lock(&self.schedule.slots[work.node]).work(work.job, at, true);
        self.begun = Some((work, at, outcome));
        Some(work.job.kind)
    }

    /// Finishes the work. `ended` is now for a whole tick, and the time of [`begin`](Self::begin)
    /// otherwise, because the scheduler plans how long a tick takes. Ticks due before
    /// `missed_before` are missed.
    pub fn done(&mut self, ended: Time, missed_before: Time) -> Outcome {
        let (work, began, outcome) = self.begun.take()?;
        let times = WorkTimes {
            began,
            ended,
            missed_before,
            took: Some(ended.since(began)),
        };
        // Nobody gets the node before its tick is recorded.
        let mut schedule = self.schedule.turn();
        let slot = &mut *lock(&self.schedule.slots[work.node]);
        let flow = schedule.done(slot, work, times, outcome, &self.schedule.state);
        flow.map(|flow| (flow == Flow::End).then_some(began))
            .transpose()
    }
}

/// Commands for its nodes.
impl Worker<'_> {
    /// Carries out the command of a node of the task set at run time `at`; returns the position of
    /// the event, or `None` if the node is not in the task set.
    pub fn obey(&mut self, command: &Command, at: Time) -> Option<usize> {
        let knob = command.knob_of_node()?;
        let mut schedule = self.schedule.turn();
        let node = schedule.node_called(knob.target())?;
        self.schedule.state.advance_to(at);
        let answer = schedule.set(node, &mut lock(&self.schedule.slots[node]), knob, at);
        Some(
            self.schedule
                .state
                .log_answered(at, command, answer.map(Some)),
        )
    }

    /// Refuses such a command for this `reason`.
    pub fn refuse(&mut self, command: &Command, at: Time, reason: &str) -> usize {
        let _turn = self.schedule.turn();
        self.schedule.state.advance_to(at);
        self.schedule.state.log_refused(at, command, reason)
    }
}

/// What it waits for.
impl Worker<'_> {
    /// Returns whether other threads share the task set with it.
    pub fn is_shared(&self) -> bool {
        self.schedule.is_shared()
    }

    /// Returns the run time of the next event of the task set; [`Time::MAX`] without one.
    pub fn next_at(&self) -> Time {
        self.schedule.peek().next_at()
    }

    /// Returns the number of ticks that keep a core busy at run time `now`.
    pub fn busy(&self, now: Time) -> usize {
        let schedule = self.schedule.peek();
        schedule.states(now).filter(|task| task.spins).count()
    }

    /// Deadline of the running tick or the next one at `now`, if the node is alone and deadlines
    /// decide who gets a core.
    pub fn deadline(&self, now: Time) -> Option<Time> {
        let first = self.schedule.first;
        self.schedule.peek().state(first, now).deadline
    }

    /// Returns the time on a core that the running tick still needs at `now`, if the node is alone.
    pub fn remaining(&self, now: Time) -> Option<Duration> {
        let first = self.schedule.first;
        self.schedule.peek().state(first, now).remaining
    }
}

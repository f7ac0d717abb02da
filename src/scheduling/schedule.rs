//! What happens to the nodes of some task sets next, whatever the clock.

use std::{collections::BTreeSet, mem::take};

use super::{
    agenda::{Agenda, AgendaItem},
    task_set::{Scheduler, TaskSet},
    timetable::{Member, SchedulerEvent, TaskState, Timetable},
};
use crate::{
    arrival::Arrival,
    control::{command::ClockKind, state::RunWriter},
    journal::AfterEnd,
    node::{Fault, Flow, Job, JobKind, NodeSlot, TickResult, WorkTimes},
    time::Time,
};

/// Task sets with their alarms: all of a graph in virtual time, one under the real clock. It
/// decides what is to be done; whoever asks does it.
pub(crate) struct Schedule {
    pub(super) task_sets: Vec<TaskSet>,
    /// The lowest index of its nodes.
    lowest: usize,
    /// The task set of each node from that one on, and its number there; (0, 0) for a node of
    /// another schedule.
    places: Vec<(usize, usize)>,
    agenda: Agenda,
    /// Task sets that look for something to do when all else of the instant has happened.
    choosing: BTreeSet<usize>,
    /// The run time at which the last of them asked for that.
    choosing_at: Time,
    clock: ClockKind,
    /// Whether the nodes have run elsewhere since it was opened, or not at all: all that is planned
    /// is out of date.
    is_behind: bool,
    /// Whether something has happened since it was last asked.
    moved: bool,
}

/// A job for a node.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Assignment {
    /// Index of the node.
    pub(crate) node: usize,
    pub(crate) job: Job,
}

/// Task sets and nodes.
impl Schedule {
    /// Creates a schedule for these task sets.
    pub(crate) fn new(clock: ClockKind, task_sets: Vec<TaskSet>) -> Self {
        let mut schedule = Self {
            task_sets: Vec::new(),
            lowest: 0,
            places: Vec::new(),
            agenda: Agenda::default(),
            choosing: BTreeSet::new(),
            choosing_at: Time::ZERO,
            clock,
            is_behind: true,
            moved: false,
        };
        schedule.set_task_sets(task_sets);
        schedule
    }

    pub(crate) fn task_sets(&self) -> &[TaskSet] {
        &self.task_sets
    }

    /// Takes the task sets away.
    pub(crate) fn take_task_sets(&mut self) -> Vec<TaskSet> {
        take(&mut self.task_sets)
    }

    /// Sets the task sets.
    pub(crate) fn set_task_sets(&mut self, task_sets: Vec<TaskSet>) {
        self.task_sets = task_sets;
        let nodes = || self.members().map(|member| member.node);
        let (lowest, last) = (nodes().min().unwrap_or(0), nodes().max());
        let count = last.map_or(0, |last| last + 1 - lowest);
        (self.lowest, self.places) = (lowest, vec![(0, 0); count]);
        for (number, task_set) in self.task_sets.iter().enumerate() {
            for (member, known) in task_set.members.iter().enumerate() {
                self.places[known.node - lowest] = (number, member);
            }
        }
    }

    /// Returns its nodes.
    pub(crate) fn members(&self) -> impl Iterator<Item = &Member> {
        self.task_sets.iter().flat_map(|task_set| &task_set.members)
    }

    /// Adds the task set of a node that is new in the graph.
    pub(crate) fn add(&mut self, task_set: TaskSet) {
        self.places.push((self.task_sets.len(), 0));
        self.task_sets.push(task_set);
    }

    /// Task set and number of a node.
    #[inline]
    pub(super) fn place(&self, node: usize) -> (usize, usize) {
        self.places[node - self.lowest]
    }

    /// Returns where a node is in its schedule at run time `now`.
    pub(crate) fn state(&self, node: usize, now: Time) -> TaskState {
        let (task_set, member) = self.place(node);
        self.task_sets[task_set].scheduler.state(member, now)
    }

    /// Returns the end of the running tick of a node; `None` if it is in none.
    pub(crate) fn end_job(&self, node: usize, now: Time) -> Option<Assignment> {
        self.state(node, now).remaining?;
        let job = Job::new(self.place(node).1, JobKind::End);
        Some(Assignment { node, job })
    }

    /// Returns whether one of its nodes has this input.
    pub(crate) fn hears(&self, arrival: Arrival) -> bool {
        self.members()
            .any(|member| member.node == arrival.node && arrival.input < member.inputs)
    }

    /// Returns the index of the node called `name`, if it is here.
    pub(crate) fn node_called(&self, name: &str) -> Option<usize> {
        let known = self.members().find(|member| *member.name == *name);
        known.map(|member| member.node)
    }

    /// Returns the states of all nodes.
    pub(crate) fn states(&self, now: Time) -> impl Iterator<Item = TaskState> {
        self.members()
            .map(move |member| self.state(member.node, now))
    }
}

/// Alarms and jobs.
impl Schedule {
    /// Forgets all that is planned: the nodes run elsewhere.
    pub(crate) fn leave(&mut self) {
        self.is_behind = true;
        self.agenda = Agenda::default();
        self.choosing.clear();
    }

    /// Returns whether the nodes have run elsewhere since it was opened, or not at all.
    pub(crate) fn is_behind(&self) -> bool {
        self.is_behind
    }

    /// Begins the task sets at run time `now`, with what arrives from then on.
    pub(crate) fn open(&mut self, now: Time, arrivals: impl IntoIterator<Item = Arrival>) {
        let anew = take(&mut self.is_behind);
        self.add_arrivals(arrivals);
        self.send_all(SchedulerEvent::Opened { anew }, now);
    }

    /// Ends the task sets at run time `now`: ticks due before `missed_before` are missed.
    pub(crate) fn close(&mut self, missed_before: Time, now: Time) {
        self.send_all(SchedulerEvent::Closed { missed_before }, now);
    }

    fn send_all(&mut self, event: SchedulerEvent, now: Time) {
        for task_set in 0..self.task_sets.len() {
            self.send(task_set, event, now, false);
        }
    }

    /// Returns the run time of the next event; [`Time::MAX`] without one.
    pub(crate) fn next_at(&self) -> Time {
        let next = self.agenda.next_at();
        if self.choosing.is_empty() {
            next
        } else {
            next.min(self.choosing_at)
        }
    }

    /// Returns whether something has happened since the last call.
    pub(crate) fn has_moved(&mut self) -> bool {
        take(&mut self.moved)
    }

    /// Returns the next job at run time `now`, which may be after the end of the run. This and what
    /// it calls are inlined: that saves a quarter of the time of a tick.
    #[inline]
    pub(crate) fn next_job(&mut self, now: Time, after: Option<AfterEnd>) -> Option<Assignment> {
        let until = after.map_or(Time::MAX, |end| end.until);
        let over = after.is_some_and(|end| end.over);
        loop {
            let next = self.agenda.next_at();
            let job = if next <= now && next <= until {
                let item = self.agenda.pop()?;
                self.moved = true;
                self.happen(item, now, over)
            } else if over {
                return None;
            } else {
                let task_set = self.choosing.pop_first()?;
                self.moved = true;
                self.send(task_set, SchedulerEvent::Choose, now, false)
            };
            if job.is_some() {
                return job;
            }
        }
    }

    /// Passes an event to its task set.
    #[inline]
    fn happen(&mut self, item: AgendaItem, now: Time, over: bool) -> Option<Assignment> {
        let (task_set, member) = self.place(item.node as usize);
        let event = match item.phase() {
            None => {
                let input = item.input as usize;
                SchedulerEvent::Arrived { member, input }
            }
            Some(phase) => {
                let at = item.at;
                SchedulerEvent::Alarm { member, at, phase }
            }
        };
        self.send(task_set, event, now, over)
    }

    /// Takes note that a job is done: the scheduler hears of it, unless it was the begin of a tick that
    /// failed, and the tick is recorded. Returns whether it ends the run of this `state`.
    ///
    /// # Errors
    /// [`Fault`] if the node failed.
    #[inline]
    pub(crate) fn done(
        &mut self,
        slot: &mut NodeSlot,
        work: Assignment,
        times: WorkTimes,
        outcome: TickResult,
        state: &RunWriter,
    ) -> Result<Flow, Fault> {
        let (job, missed_before) = (work.job, times.missed_before);
        if outcome.is_ok() || job.kind != JobKind::Begin {
            let done = SchedulerEvent::Done { job, missed_before };
            self.send(self.place(work.node).0, done, times.ended, false);
        }
        let outcome = slot.done(job, times, outcome);
        self.outlive(slot, work.node, times.began, outcome, state)
    }

    #[inline]
    pub(super) fn send(
        &mut self,
        number: usize,
        event: SchedulerEvent,
        now: Time,
        over: bool,
    ) -> Option<Assignment> {
        self.with(number, now, over, |scheduler, timetable| {
            let job = scheduler.on(event, timetable)?;
            let node = timetable.members[job.member()].node;
            Some(Assignment { node, job })
        })
    }

    #[inline]
    pub(super) fn with<R>(
        &mut self,
        number: usize,
        now: Time,
        over: bool,
        ask: impl FnOnce(&mut Scheduler, &mut Timetable<'_>) -> R,
    ) -> R {
        let task_set = &mut self.task_sets[number];
        let mut chooses = false;
        let mut timetable = Timetable {
            now,
            clock: self.clock,
            over,
            members: &task_set.members,
            agenda: &mut self.agenda,
            chooses: &mut chooses,
        };
        let answer = ask(&mut task_set.scheduler, &mut timetable);
        if chooses {
            self.choosing_at = now;
            self.choosing.insert(number);
        }
        answer
    }

    /// Plans the arrivals of messages.
    #[inline]
    pub(crate) fn add_arrivals(&mut self, arrivals: impl IntoIterator<Item = Arrival>) {
        for Arrival { at, node, input } in arrivals {
            self.agenda.add_arrival(at, node, input);
        }
    }
}

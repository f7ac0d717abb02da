//! A thread of a task set: what it does for its nodes, at the times that its clock knows. The real
//! clock asks the wall, a rerun of the run its log.

use std::{ops::ControlFlow, time::Duration};

use super::shared_schedule::SharedSchedule;
use crate::{
    command::Command,
    journal::LateLook,
    node::{Fault, Tick},
    scheduling::{Assignment, Moment, WorkTimes},
    sync::lock,
    time::Time,
    trigger::Arrival,
};

/// A node ended the run at this run time, or failed.
pub type Outcome = Option<Result<Time, Fault>>;

/// What a thread of a task set has to do with its nodes.
pub struct Worker<'c> {
    /// That of its task set.
    schedule: &'c SharedSchedule<'c>,
    /// The messages that it has heard of since its last look.
    arrivals: Vec<Arrival>,
    /// The work that is not yet over, with the run time of its begin.
    work: Option<(Assignment, Time, Tick)>,
}

/// What a look has found.
pub(crate) struct LookResult {
    pub(crate) work: Option<Assignment>,
    /// Whether anything has happened.
    pub(crate) moved: bool,
}

impl<'c> Worker<'c> {
    pub(crate) fn new(schedule: &'c SharedSchedule<'c>) -> Self {
        Self {
            schedule,
            arrivals: Vec::new(),
            work: None,
        }
    }

    pub(crate) fn schedule(&self) -> &'c SharedSchedule<'c> {
        self.schedule
    }

    /// Hears that a message arrives for a node of the task set.
    pub fn arrive(&mut self, arrival: Arrival) {
        if self.schedule.peek().hears(arrival) {
            self.arrivals.push(arrival);
        }
    }

    /// Looks for work at run time `at`, and does it; returns the index of the node that did
    /// some.
    pub fn look(&mut self, at: Time, late: Option<LateLook>) -> Option<usize> {
        self.schedule.state.advance_to(at);
        let work = self.find(at, late).work?;
        self.work(work, at);
        Some(work.node)
    }

    /// Looks for work at run time `at`.
    pub(crate) fn find(&mut self, at: Time, late: Option<LateLook>) -> LookResult {
        let mut schedule = self.schedule.turn();
        for arrival in self.arrivals.drain(..) {
            schedule.add_arrival(arrival);
        }
        let work = schedule.look(Moment::of(at, late));
        let moved = schedule.has_moved();
        LookResult { work, moved }
    }

    /// Ends the running tick at run time `at`, if there is one: it has had its time on a core.
    pub fn finish(&mut self, at: Time) -> Option<usize> {
        let work = self.schedule.end_of_first(at)?;
        self.work(work, at);
        Some(work.node)
    }

    /// Has a node do its work, which begins at run time `began`.
    pub(crate) fn work(&mut self, work: Assignment, began: Time) {
        self.schedule.state.advance_to(began);
        let outcome = lock(self.schedule.slot(work.node)).work(work.job, began, true);
        self.work = Some((work, began, outcome));
    }

    /// That work is over at run time `ended`; ticks due before `passed` are missed.
    pub fn done(&mut self, ended: Time, passed: Time) -> Outcome {
        let (work, began, outcome) = self.work.take()?;
        let times = WorkTimes {
            began,
            ended,
            passed,
            took: Some(ended.since(began)),
        };
        // Nobody gets the node before its tick is recorded.
        let mut schedule = self.schedule.turn();
        let slot = &mut *lock(self.schedule.slot(work.node));
        match schedule.done(slot, work, times, outcome) {
            Ok(ControlFlow::Continue(())) => None,
            Ok(ControlFlow::Break(())) => Some(Ok(began)),
            Err(cause) => Some(Err(slot.fault(began, cause))),
        }
    }

    /// Has a node of the task set carry out its command at run time `at`; returns the position of
    /// the event, or `None` if the node is not in the task set.
    pub fn obey(&mut self, command: &Command, at: Time) -> Option<usize> {
        let knob = command.knob_of_node()?;
        let mut schedule = self.schedule.turn();
        let node = schedule.node_called(knob.target())?;
        self.schedule.state.advance_to(at);
        let answer = schedule.turn(node, &mut lock(self.schedule.slot(node)), knob, at);
        Some(self.schedule.state.answered(at, command, answer))
    }

    /// Refuses such a command for this `reason`.
    pub fn refuse(&mut self, command: &Command, at: Time, reason: &str) -> usize {
        let _turn = self.schedule.turn();
        self.schedule.state.advance_to(at);
        self.schedule.state.refused(at, command, reason)
    }

    /// Time on a core that the running tick still needs at `now`, if the node is alone.
    pub(crate) fn remaining(&self, now: Time) -> Option<Duration> {
        self.schedule
            .peek()
            .state(self.schedule.first, now)
            .remaining
    }
}

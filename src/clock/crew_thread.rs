//! A thread of a crew: what it does for its nodes, at the times that its clock knows. The real
//! clock asks the wall, a rerun of the run its log.

use std::{ops::ControlFlow, time::Duration};

use super::crew_stage::CrewStage;
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

/// A thread of a crew.
pub struct CrewThread<'c> {
    crew: &'c CrewStage<'c>,
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

impl<'c> CrewThread<'c> {
    pub(crate) fn new(crew: &'c CrewStage<'c>) -> Self {
        Self {
            crew,
            arrivals: Vec::new(),
            work: None,
        }
    }

    pub(crate) fn crew(&self) -> &'c CrewStage<'c> {
        self.crew
    }

    /// Hears that a message arrives for a node of the crew.
    pub fn arrive(&mut self, arrival: Arrival) {
        if self.crew.aside().hears(arrival) {
            self.arrivals.push(arrival);
        }
    }

    /// Looks for work at run time `at`, and does it; returns the index of the node that did
    /// some.
    pub fn look(&mut self, at: Time, late: Option<LateLook>) -> Option<usize> {
        self.crew.state.advance_to(at);
        let work = self.find(at, late).work?;
        self.work(work, at);
        Some(work.node)
    }

    /// Looks for work at run time `at`.
    pub(crate) fn find(&mut self, at: Time, late: Option<LateLook>) -> LookResult {
        let mut stage = self.crew.stage();
        for arrival in self.arrivals.drain(..) {
            stage.add_arrival(arrival);
        }
        let work = stage.look(Moment::of(at, late));
        let moved = stage.has_moved();
        LookResult { work, moved }
    }

    /// Ends the running tick at run time `at`, if there is one: it has had its time on a core.
    pub fn finish(&mut self, at: Time) -> Option<usize> {
        let work = self.crew.end_of_first(at)?;
        self.work(work, at);
        Some(work.node)
    }

    /// Has a node do its work, which begins at run time `began`.
    pub(crate) fn work(&mut self, work: Assignment, began: Time) {
        self.crew.state.advance_to(began);
        let outcome = lock(self.crew.seat(work.node)).work(work.job, began, true);
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
        let mut stage = self.crew.stage();
        let seat = &mut *lock(self.crew.seat(work.node));
        match stage.done(seat, work, times, outcome) {
            Ok(ControlFlow::Continue(())) => None,
            Ok(ControlFlow::Break(())) => Some(Ok(began)),
            Err(cause) => Some(Err(seat.fault(began, cause))),
        }
    }

    /// Has a node of the crew carry out its command at run time `at`; returns the position of
    /// the event, or `None` if the node is not in the crew.
    pub fn obey(&mut self, command: &Command, at: Time) -> Option<usize> {
        let knob = command.knob_of_node()?;
        let mut stage = self.crew.stage();
        let node = stage.node_called(knob.target())?;
        self.crew.state.advance_to(at);
        let answer = stage.turn(node, &mut lock(self.crew.seat(node)), knob, at);
        Some(self.crew.state.answered(at, command, answer))
    }

    /// Refuses such a command for this `reason`.
    pub fn refuse(&mut self, command: &Command, at: Time, reason: &str) -> usize {
        let _stage = self.crew.stage();
        self.crew.state.advance_to(at);
        self.crew.state.refused(at, command, reason)
    }

    /// Time on a core that the running tick still needs at `now`, if the node is alone.
    pub(crate) fn remaining(&self, now: Time) -> Option<Duration> {
        self.crew.aside().state(self.crew.first, now).remaining
    }
}

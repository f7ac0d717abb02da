//! Nodes in the hands of a clock of another crate, which decides itself what they do when.

use std::time::Duration;

use super::{
    obey::Obeyed,
    steps::{self, Outcome},
};
use crate::{
    command::Command,
    graph::{ControlPlane, Graph},
    seat::Seat,
    state::RunState,
    sync::Arc,
    task::Task,
    time::Time,
    timing::Running,
    trigger::{Arrival, Wake},
};

/// The end of a tick that takes no run time.
#[derive(Clone, Copy, Debug)]
pub struct TickEnd {
    /// Duration.
    pub took: Duration,
    /// Ticks due before this are missed.
    pub passed: Time,
}

/// A node of a graph, for one thread.
pub struct NodeHand<'g> {
    task: &'g mut Task,
    seat: &'g mut Seat,
    state: Arc<RunState>,
}

/// What is left of a graph without its nodes, for one thread.
pub struct SupervisorHand<'g>(&'g mut ControlPlane);

/// Nobody waits for messages: the clock knows when nodes look for them.
struct Unheard;

impl Wake for Unheard {
    fn wake(&self, _: Arrival) {}
}

impl Graph {
    /// Takes the nodes into the hands of the caller, until a clock runs the graph again.
    pub fn take_in_hand(&mut self) {
        self.stage.leave(Arc::new(Unheard));
    }

    /// The node with this index.
    pub fn node_hand(&mut self, index: usize) -> Option<NodeHand<'_>> {
        let state = self.state();
        let task = self.stage.tasks.get_mut(index)?;
        let seat = self.seats.get_mut(index)?;
        Some(NodeHand { task, seat, state })
    }

    /// What is left without the nodes.
    pub fn supervisor_hand(&mut self) -> SupervisorHand<'_> {
        SupervisorHand(&mut self.control)
    }

    /// All of these at once, each for a thread of its own.
    pub fn hands(&mut self) -> (SupervisorHand<'_>, impl Iterator<Item = NodeHand<'_>>) {
        let state = self.state();
        let nodes = self.stage.tasks.iter_mut().zip(&mut self.seats);
        let nodes = nodes.map(move |(task, seat)| NodeHand {
            task,
            seat,
            state: state.clone(),
        });
        (SupervisorHand(&mut self.control), nodes)
    }
}

impl SupervisorHand<'_> {
    /// Carries out, at run time `at`, a command that no node can.
    pub fn obey(&mut self, command: &Command, at: Time) -> Obeyed {
        steps::supervise(self.0, command, at)
    }
}

impl NodeHand<'_> {
    /// Name of the node.
    pub fn name(&self) -> Arc<str> {
        self.seat.name.clone()
    }

    /// Begins the next tick at run time `began`, and ends it if it takes no run time: `end` gives
    /// its end then. `None` if it lacks inputs, or is not due.
    pub fn tick(&mut self, began: Time, end: impl FnOnce() -> TickEnd) -> Option<Outcome> {
        self.state.advance_to(began);
        let due = self.take_due(began)?;
        let lateness = Some(began.since(due));
        Some(match self.task.takes(began) {
            Some(takes) => self.start(began, takes, lateness),
            None => {
                let outcome = self.seat.tick(began, true);
                let TickEnd { took, passed } = end();
                self.task.overrun_until(passed);
                steps::note_tick(self.seat, began, lateness, took);
                steps::result(self.seat, began, outcome)
            }
        })
    }

    fn start(&mut self, began: Time, takes: Duration, lateness: Option<Duration>) -> Outcome {
        match self.seat.start(began) {
            Ok(flow) => {
                let running = Running::new(began, began + takes, lateness, flow);
                self.task.begin(running);
                None
            }
            Err(cause) => Some(Err(self.seat.fault(began, cause))),
        }
    }

    /// Moves on to the next tick, at run time `now`; returns when it was due. A node that messages
    /// trigger takes them: `None` if they are not yet the inputs of a tick, and for a timer of an
    /// executor that is not due.
    fn take_due(&mut self, now: Time) -> Option<Time> {
        let task = &mut *self.task;
        match (task.is_triggered(), task.has_thread()) {
            (true, _) => {
                task.waited();
                task.take(now)
            }
            (false, true) => Some(task.take_due()),
            (false, false) => task.call_timer(now),
        }
    }

    /// Has it take messages at run time `at` that are not yet the inputs of a tick; `false` if
    /// they are.
    pub fn look(&mut self, at: Time) -> bool {
        self.state.advance_to(at);
        self.take_due(at).is_none()
    }

    /// Has it take its next messages from this input only.
    pub fn choose(&mut self, input: usize) {
        self.task.choose_input(input);
    }

    /// Ends a tick that takes time. Ticks due before `passed` are missed.
    pub fn finish(&mut self, ended: Time, passed: Time) -> Outcome {
        self.state.advance_to(ended);
        let applied = self.seat.finish(ended);
        let running = self.task.end()?;
        self.task.overrun_until(passed);
        let outcome = self.seat.over(&running, ended, applied);
        steps::result(self.seat, ended, outcome)
    }

    /// Has it carry out its command at run time `at`; returns the position of the event.
    pub fn obey(&mut self, command: &Command, at: Time) -> usize {
        steps::obey_node(self.task, self.seat, &self.state, command, at)
    }

    /// Ends its thread: ticks due before `before` are missed.
    pub fn leave(&mut self, before: Time) {
        self.task.overrun_before(before);
    }
}

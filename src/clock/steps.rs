//! What the real clock and another execution of its runs have in common.

use std::{ops::ControlFlow, time::Duration};

use super::obey::{self, Obeyed};
use crate::{
    command::{ClockKind, Command},
    graph::ControlPlane,
    node::{Fault, Tick},
    node_knobs,
    record::TickTimes,
    seat::Seat,
    state::RunState,
    task::Task,
    time::Time,
};

/// A node ended the run at this run time, or failed.
pub type Outcome = Option<Result<Time, Fault>>;

/// Records a tick that took no run time.
pub(super) fn note_tick(seat: &Seat, began: Time, lateness: Option<Duration>, took: Duration) {
    seat.record(TickTimes {
        at: began,
        lateness,
        took: Some(took),
        ends: Some(began),
    });
}

/// Has a node carry out its command; returns the position of the event.
pub(super) fn obey_node(
    task: &mut Task,
    seat: &mut Seat,
    state: &RunState,
    command: &Command,
    at: Time,
) -> usize {
    state.advance_to(at);
    let answer = node_knobs::obey(task, seat, command, at);
    state.answered(at, command, answer)
}

/// Carries out a command that no node can.
pub(super) fn supervise(control: &mut ControlPlane, command: &Command, at: Time) -> Obeyed {
    let unknown = command
        .node()
        .and_then(|node| control.local_index(node).err());
    let obeyed = match unknown {
        Some(reason) => obey::refuse(control, command, at, &reason),
        None => obey::obey(control, ClockKind::Real, command, at),
    };
    if obeyed.exit.is_some() || control.status.paused {
        // A node may have begun a tick later than `at` already.
        control.state.advance_to(at);
    }
    obeyed
}

/// What came of a tick whose work was done at `at`.
pub(super) fn result(seat: &Seat, at: Time, outcome: Tick) -> Outcome {
    match outcome {
        Ok(ControlFlow::Continue(())) => None,
        Ok(ControlFlow::Break(())) => Some(Ok(at)),
        Err(cause) => Some(Err(seat.fault(at, cause))),
    }
}

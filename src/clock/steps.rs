//! The steps of a node under the real clock, between two waits, with the times of a log.

use std::{ops::ControlFlow, time::Duration};

use super::obey;
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
    timing::Running,
};

/// The end of a tick that takes no run time.
#[derive(Clone, Copy, Debug)]
pub(super) struct TickEnd {
    /// Duration.
    pub(super) took: Duration,
    /// Ticks due before this are missed.
    pub(super) passed: Time,
}

/// A node ended the run at this run time, or failed.
pub(super) type Outcome = Option<Result<Time, Fault>>;

/// Moves on to the next tick, at run time `now`; returns when it was due. A node that
/// messages trigger takes them: `None` if they are not yet the inputs of a tick, and for a timer
/// of an executor that is not due.
pub(super) fn take_due(task: &mut Task, now: Time) -> Option<Time> {
    match (task.is_triggered(), task.has_thread()) {
        (true, _) => {
            task.waited();
            task.take(now)
        }
        (false, true) => Some(task.take_due()),
        (false, false) => task.call_timer(now),
    }
}

/// Does the tick that was `due`, at run time `began`; `end` gives the end of a tick that
/// takes no run time.
pub(super) fn tick(
    task: &mut Task,
    seat: &mut Seat,
    due: Time,
    began: Time,
    end: impl FnOnce() -> TickEnd,
) -> Outcome {
    let lateness = Some(began.since(due));
    if let Some(takes) = task.takes(began) {
        return match seat.start(began) {
            Ok(flow) => {
                task.begin(Running::new(began, began + takes, lateness, flow));
                None
            }
            Err(cause) => Some(Err(seat.fault(began, cause))),
        };
    }
    let outcome = seat.tick(began, true);
    let TickEnd { took, passed } = end();
    task.overrun_until(passed);
    note_tick(seat, began, lateness, took);
    result(seat, began, outcome)
}

/// Records a tick that took no run time.
pub(super) fn note_tick(seat: &Seat, began: Time, lateness: Option<Duration>, took: Duration) {
    seat.record(TickTimes {
        at: began,
        lateness,
        took: Some(took),
        ends: Some(began),
    });
}

/// Ends a tick that takes time. Ticks due before `passed` are missed.
pub(super) fn finish(task: &mut Task, seat: &mut Seat, ended: Time, passed: Time) -> Outcome {
    let applied = seat.finish(ended);
    let running = task.end()?;
    task.overrun_until(passed);
    let outcome = seat.over(&running, ended, applied);
    result(seat, ended, outcome)
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
pub(super) fn supervise(control: &mut ControlPlane, command: &Command, at: Time) -> obey::Obeyed {
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

//! The steps of a graph under the real clock, between two waits: the same whether the wall
//! gives their times or a log does.

use std::{ops::ControlFlow, time::Duration};

use super::obey;
use crate::runtime::{
    command::{ClockKind, Command},
    graph::ControlPlane,
    node::{Fault, Tick},
    scheduled_node::ScheduledNode,
    sync::atomic::Ordering,
    telemetry::RunState,
    time::Time,
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
pub(super) fn take_due(node: &mut ScheduledNode, state: &RunState, now: Time) -> Option<Time> {
    state.advance_to(now);
    match (node.is_triggered(), node.has_thread()) {
        (true, _) => {
            node.waited();
            node.take(now)
        }
        (false, true) => Some(node.take_due()),
        (false, false) => node.call_timer(now),
    }
}

/// Does the tick that was `due`, at run time `began`; `end` measures the end, of a tick that
/// takes no run time.
pub(super) fn tick(
    node: &mut ScheduledNode,
    due: Time,
    began: Time,
    end: impl FnOnce() -> TickEnd,
) -> Outcome {
    let lateness = Some(began.since(due));
    if let Some(takes) = node.takes(began) {
        let started = node.start(began, takes, lateness);
        return started.err().map(|cause| Err(node.fault(began, cause)));
    }
    node.entry.counters.busy.store(true, Ordering::Relaxed);
    let outcome = node.tick(began);
    node.entry.counters.busy.store(false, Ordering::Relaxed);
    let TickEnd { took, passed } = end();
    node.overrun_until(passed);
    node.note_tick(began, lateness, Some(took), Some(began));
    result(node, began, outcome)
}

/// Ends a tick that takes time. Ticks due before `passed` are missed.
pub(super) fn finish(
    node: &mut ScheduledNode,
    state: &RunState,
    ended: Time,
    passed: Time,
) -> Outcome {
    state.advance_to(ended);
    let outcome = node.finish(ended, passed);
    result(node, ended, outcome)
}

/// Has a node carry out its command; returns the position of the event.
pub(super) fn obey_node(
    node: &mut ScheduledNode,
    state: &RunState,
    command: &Command,
    at: Time,
) -> usize {
    state.advance_to(at);
    let answer = node.obey(command, at);
    state.log.answered(at, command, answer)
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
fn result(node: &ScheduledNode, at: Time, outcome: Tick) -> Outcome {
    match outcome {
        Ok(ControlFlow::Continue(())) => None,
        Ok(ControlFlow::Break(())) => Some(Ok(at)),
        Err(cause) => Some(Err(node.fault(at, cause))),
    }
}

//! Two schedulers behind one interface.
//!
//! A clock runs a [`Graph`] until it ends, is stopped, reaches a given run time, or is
//! handed over to the other clock. All state of the run stays in the graph, so [`run`]
//! can pass it back and forth.
//!
//! Commands take effect *between* ticks. Under the virtual clock that means between
//! instants: nodes that are due together see the same world, and the run time of a
//! command is enough to repeat it.

mod event_queue;
mod mailbox;
mod pacer;
mod real;
mod realtime;
mod virtual_time;
mod wall;

pub use real::RealClock;
pub use realtime::{RealtimeError, RealtimePriority, lower_priority};
pub use virtual_time::VirtualClock;

use super::{
    command::{ClockKind, Command},
    graph::{ControlPlane, Graph},
    inbox::Inbox,
    node::Fault,
    telemetry::EventKind,
    time::Time,
};

/// Runs a graph.
pub trait Clock {
    /// Kind of this clock.
    fn kind(&self) -> ClockKind;

    /// Runs `graph` from its current run time up to and including `until`, and carries
    /// out the commands in `inbox`.
    ///
    /// # Errors
    /// [`Fault`] if a node failed; all other nodes have stopped by then.
    fn run(
        &mut self,
        graph: &mut Graph,
        inbox: &mut Inbox,
        until: Time,
    ) -> Result<ClockExit, Fault>;
}

/// Why a clock stopped.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ClockExit {
    /// Run time reached the requested end.
    Completed,
    /// A node ended the run.
    Ended {
        /// Name of the node.
        node: String,
        /// Run time of its last tick.
        at: Time,
    },
    /// A command stopped the run.
    Stopped,
    /// A command hands the graph to the other clock.
    HandedOver(ClockKind),
}

/// Runs a graph to its end, with handovers between the clocks.
///
/// # Errors
/// [`Fault`] if a node failed.
pub fn run(
    graph: &mut Graph,
    inbox: &mut Inbox,
    until: Time,
    first: ClockKind,
    real: &mut RealClock,
) -> Result<ClockExit, Fault> {
    let mut kind = first;
    loop {
        let exit = match kind {
            ClockKind::Real => real.run(graph, inbox, until),
            ClockKind::Virtual => VirtualClock.run(graph, inbox, until),
        };
        match exit? {
            ClockExit::HandedOver(next) => kind = next,
            exit => return Ok(exit),
        }
    }
}

/// Logs the end of the run for observers: the node that ended it, and unfinished ticks.
fn note_end(graph: &mut Graph, end: &Result<ClockExit, Fault>) {
    let ended = match end {
        Ok(ClockExit::HandedOver(_)) => return,
        Ok(ClockExit::Ended { node, at }) => {
            let node = node.clone();
            Some((*at, EventKind::Ended { node }))
        }
        Err(fault) => {
            let (node, cause) = (fault.node.clone(), fault.cause.to_string());
            Some((fault.at, EventKind::Faulted { node, cause }))
        }
        Ok(ClockExit::Completed | ClockExit::Stopped) => None,
    };
    graph.control.deliver(graph.now());
    for node in graph.nodes.iter_mut().filter(|node| !node.entry.remote) {
        if let Some((at, _)) = ended {
            // Ticks due at the end are missed, even though no node ticks any more.
            node.overrun_before(at + Time::TICK);
        }
        node.cut_off();
    }
    if let Some((at, what)) = ended {
        graph.control.log().note(at, what);
    }
}

/// Carries out a command that needs no node, as both clocks do; `Some` if the clock must
/// stop.
fn obey(
    control: &mut ControlPlane,
    kind: ClockKind,
    command: &Command,
    at: Time,
) -> Option<ClockExit> {
    let was = match command {
        Command::Set(knob) => match control.turn(knob, at) {
            Ok(before) => Some(before),
            Err(reason) => return refuse(control, command, at, &reason),
        },
        Command::Pause | Command::HandOver(_) if control.is_part() => {
            let reason = "its nodes run in several processes, which share the wall's time";
            return refuse(control, command, at, reason);
        }
        Command::Pause => {
            control.update(|status| status.paused = true);
            None
        }
        Command::Resume => {
            control.update(|status| status.paused = false);
            None
        }
        Command::Speed(_) | Command::Step if kind == ClockKind::Real => {
            let reason =
                "the real clock knows one speed, that of the wall; hand over to the virtual clock";
            return refuse(control, command, at, reason);
        }
        Command::Speed(speed) => {
            let before = control.status.speed;
            control.update(|status| status.speed = *speed);
            Some(before.to_string())
        }
        Command::HandOver(next) if *next == kind => {
            return refuse(control, command, at, "it runs under that clock already");
        }
        Command::Step | Command::HandOver(_) | Command::Stop => None,
    };
    control.log().applied(at, command, was);
    match command {
        Command::Stop => Some(ClockExit::Stopped),
        Command::HandOver(next) => Some(ClockExit::HandedOver(*next)),
        _ => None,
    }
}

fn refuse(control: &ControlPlane, command: &Command, at: Time, reason: &str) -> Option<ClockExit> {
    control.log().refused(at, command, reason);
    None
}

/// Carries out any command while no node is in a tick.
fn obey_at_rest(
    graph: &mut Graph,
    kind: ClockKind,
    command: &Command,
    at: Time,
) -> Option<ClockExit> {
    if let Some(node) = command.node() {
        let answer = graph.obey(node, command, at);
        graph.control.log().answered(at, command, answer);
        return None;
    }
    obey(&mut graph.control, kind, command, at)
}

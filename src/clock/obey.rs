//! How a clock carries out commands.

use super::ClockExit;
use crate::{
    control::command::{ClockKind, Command},
    graph::{ControlPlane, Graph},
    time::Time,
};

/// A command that was carried out or refused.
pub struct Obeyed {
    /// Position of its event.
    pub event: usize,
    /// Set if the clock must stop.
    pub exit: Option<ClockExit>,
}

/// Carries out a command that needs no node, as both clocks do.
pub(super) fn obey(control: &mut ControlPlane, command: &Command, at: Time) -> Obeyed {
    let kind = control.status.clock;
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
    Obeyed {
        event: control.state.applied(at, command, was),
        exit: match command {
            Command::Stop => Some(ClockExit::Stopped),
            Command::HandOver(next) => Some(ClockExit::HandedOver(*next)),
            _ => None,
        },
    }
}

pub(super) fn refuse(control: &ControlPlane, command: &Command, at: Time, reason: &str) -> Obeyed {
    let event = control.state.refused(at, command, reason);
    Obeyed { event, exit: None }
}

/// Carries out any command at run time `at`, while no node does any work.
pub fn obey_at_rest(graph: &mut Graph, command: &Command, at: Time) -> Obeyed {
    if let Some(knob) = command.knob_of_node() {
        let answer = graph.turn_node(knob, at);
        let event = graph.control.state.answered(at, command, answer);
        return Obeyed { event, exit: None };
    }
    let refusal = match command {
        Command::HandOver(clock) => graph.refusal_of(*clock),
        _ => None,
    };
    match refusal {
        Some(reason) => refuse(&graph.control, command, at, &reason),
        None => obey(&mut graph.control, command, at),
    }
}

/// What is left of a graph while its nodes are on their threads, for the thread that supervises
/// them.
pub struct Supervision<'g> {
    pub(crate) control: &'g mut ControlPlane,
}

impl Supervision<'_> {
    /// Index of the node that has to carry out a command, if it is here.
    pub fn node_for(&self, command: &Command) -> Option<usize> {
        let node = command.node()?;
        self.control.local_index(node).ok()
    }

    /// Carries out, at run time `at`, a command that no node can.
    pub fn obey(&mut self, command: &Command, at: Time) -> Obeyed {
        let control = &mut *self.control;
        let unknown = command
            .node()
            .and_then(|node| control.local_index(node).err());
        let obeyed = match unknown {
            Some(reason) => refuse(control, command, at, &reason),
            None => obey(control, command, at),
        };
        if obeyed.exit.is_some() || control.status.paused {
            // A node may have begun a tick later than `at` already.
            control.state.advance_to(at);
        }
        obeyed
    }
}

//! Who carries out a command.
//!
//! | | while the nodes are at rest: in virtual time, in a pause | while they are on threads |
//! |---|---|---|
//! | a knob of a node | the clock: [`obey_at_rest`] | a thread of its task set, between two jobs of the node: [`Worker::obey`](crate::clock::Worker::obey) |
//! | anything else | the clock: [`obey_at_rest`] | the thread that supervises the others: [`Supervision::obey`] |
//!
//! All log it, with the value before or the reason for a refusal.

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
fn obey_without_nodes(control: &mut ControlPlane, command: &Command, at: Time) -> Obeyed {
    let kind = control.status.clock;
    let refused = |reason: &str| Err(reason.to_owned());
    let answer = match command {
        Command::Set(knob) => match control.set(knob, at) {
            Ok(before) => Ok(command.replaced(Some(&before))),
            Err(why) => Err(why.to_string()),
        },
        Command::Pause | Command::HandOver(_) if control.is_part() => {
            refused("this run has several processes: it can be neither paused nor handed over")
        }
        Command::Speed(_) | Command::Step if kind == ClockKind::Real => refused(
            "the real clock knows one speed, that of the wall; hand over to the virtual clock",
        ),
        Command::HandOver(next) if *next == kind => refused("it runs under that clock already"),
        Command::Pause | Command::Resume => {
            control.update(|status| status.paused = *command == Command::Pause);
            Ok(None)
        }
        Command::Speed(speed) => {
            let before = control.status.speed;
            control.update(|status| status.speed = *speed);
            Ok(Some(before.to_string()))
        }
        Command::Step | Command::HandOver(_) | Command::Stop => Ok(None),
    };
    match answer {
        Err(reason) => refuse(control, command, at, &reason),
        Ok(was) => Obeyed {
            event: control.state.log_applied(at, command, was),
            exit: match command {
                Command::Stop => Some(ClockExit::Stopped),
                Command::HandOver(next) => Some(ClockExit::HandedOver(*next)),
                _ => None,
            },
        },
    }
}

fn refuse(control: &ControlPlane, command: &Command, at: Time, reason: &str) -> Obeyed {
    let event = control.state.log_refused(at, command, reason);
    Obeyed { event, exit: None }
}

/// Carries out any command at run time `at`, while no node does any work.
pub fn obey_at_rest(graph: &mut Graph, command: &Command, at: Time) -> Obeyed {
    if let Some(knob) = command.knob_of_node() {
        let answer = graph.set_node(knob, at);
        let event = graph.control.state.log_answered(at, command, answer);
        return Obeyed { event, exit: None };
    }
    let refusal = match command {
        Command::HandOver(clock) => graph.refusal_of(*clock),
        _ => None,
    };
    match refusal {
        Some(reason) => refuse(&graph.control, command, at, &reason),
        None => obey_without_nodes(&mut graph.control, command, at),
    }
}

/// What is left of a graph while its nodes are on their threads, for the thread that supervises
/// them.
pub struct Supervision<'g> {
    pub(crate) control: &'g mut ControlPlane,
}

impl Supervision<'_> {
    /// Returns the index of the node that has to carry out a command, if it is here.
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
            Some(reason) => refuse(control, command, at, &reason.to_string()),
            None => obey_without_nodes(control, command, at),
        };
        if obeyed.exit.is_some() || control.status.paused {
            // A node may have begun a tick later than `at` already.
            control.state.advance_to(at);
        }
        obeyed
    }
}

//! What happened in a run beside ticks and messages.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::{
    command::{Command, TimedCommand},
    knob::{Knob, TimedKnob},
};
use crate::time::Time;

/// An event of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// Run time at which it took effect.
    pub at: Time,
    /// Kind of the event.
    pub what: EventKind,
}

/// The kinds of [`Event`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum EventKind {
    /// A command took effect.
    Applied {
        /// The command.
        command: Command,
        /// The value it replaced, as text, where it replaced one.
        was: Option<String>,
    },
    /// A command was refused.
    Refused {
        /// The command.
        command: Command,
        /// The reason and a remedy.
        reason: String,
    },
    /// A node ended the run.
    Ended {
        /// Name of the node.
        node: String,
    },
    /// A node failed.
    Faulted {
        /// Name of the node.
        node: String,
        /// The error.
        cause: String,
    },
    /// A node has crashed by itself, and the run goes on.
    Crashed {
        /// Name of the node.
        node: String,
        /// The reason and a remedy.
        cause: String,
    },
    /// A node in another process appeared, or fell silent.
    Presence {
        /// Name of the node.
        node: String,
        /// Whether its messages arrive.
        present: bool,
        /// The observation, such as `silent for 100 ms`.
        what: String,
    },
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", self.at)?;
        match &self.what {
            EventKind::Applied {
                command,
                was: Some(was),
            } => write!(f, "{command} (was {was})"),
            EventKind::Applied { command, was: None } => command.fmt(f),
            EventKind::Refused { command, reason } => write!(f, "{command} refused: {reason}"),
            EventKind::Ended { node } => write!(f, "{node} ended the run"),
            EventKind::Faulted { node, cause } => write!(f, "{node} failed: {cause}"),
            EventKind::Crashed { node, cause } => write!(f, "{node} crashed: {cause}"),
            EventKind::Presence { node, what, .. } => write!(f, "{node}: {what}"),
        }
    }
}

impl Event {
    /// Returns the command, if it took effect.
    pub fn applied(&self) -> Option<&Command> {
        match &self.what {
            EventKind::Applied { command, .. } => Some(command),
            _ => None,
        }
    }

    /// Returns the knob that was changed, with its time, if one was.
    pub fn knob(&self) -> Option<TimedKnob> {
        match self.applied()? {
            Command::Set(knob) => Some(TimedKnob {
                at: self.at,
                knob: knob.clone(),
            }),
            _ => None,
        }
    }

    /// Returns the knob that was set; for a node that crashed by itself, the crash of it.
    pub fn change(&self) -> Option<TimedKnob> {
        match &self.what {
            EventKind::Crashed { node, .. } => Some(TimedKnob {
                at: self.at,
                knob: Knob::Crash { node: node.clone() },
            }),
            _ => self.knob(),
        }
    }

    /// Returns the event as a command that repeats it, if it changed the result of the graph: a
    /// run on the virtual clock with the same configuration and these commands is the
    /// same run.
    pub fn replayable(&self) -> Option<TimedCommand> {
        match &self.what {
            EventKind::Applied { command, .. }
                if matches!(command, Command::Set(_) | Command::Stop) =>
            {
                Some(TimedCommand {
                    at: self.at,
                    command: command.clone(),
                })
            }
            _ => None,
        }
    }
}

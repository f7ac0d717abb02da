//! The log of what changed a run: commands and ends, not messages.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::runtime::{
    command::{Command, TimedCommand},
    knob::TimedKnob,
    sync::{Mutex, lock},
    time::Time,
};

/// Something worth telling that happened to a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// Run time at which it took effect.
    pub at: Time,
    /// What it was.
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
    /// A command was not carried out.
    Refused {
        /// The command.
        command: Command,
        /// Why, and what to do instead.
        reason: String,
    },
    /// A node ended the run.
    Ended {
        /// Its name.
        node: String,
    },
    /// A node failed.
    Faulted {
        /// Its name.
        node: String,
        /// What went wrong.
        cause: String,
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
        }
    }
}

/// The events of a run in the order in which they happened. Touched by rare
/// events only, never by a tick.
#[derive(Debug, Default)]
pub(crate) struct EventLog(Mutex<Vec<Event>>);

impl EventLog {
    pub(crate) fn note(&self, at: Time, what: EventKind) {
        lock(&self.0).push(Event { at, what });
    }

    pub(crate) fn applied(&self, at: Time, command: &Command, was: Option<String>) {
        let command = command.clone();
        self.note(at, EventKind::Applied { command, was });
    }

    pub(crate) fn refused(&self, at: Time, command: &Command, reason: impl Into<String>) {
        let (command, reason) = (command.clone(), reason.into());
        self.note(at, EventKind::Refused { command, reason });
    }

    /// A node did as `command` says, which replaced a value, or said why not.
    pub(crate) fn answered(&self, at: Time, command: &Command, answer: Result<String, String>) {
        match answer {
            Ok(was) => self.applied(at, command, Some(was)),
            Err(reason) => self.refused(at, command, reason),
        }
    }

    /// The events from number `first` on.
    pub(crate) fn since(&self, first: usize) -> Vec<Event> {
        lock(&self.0).iter().skip(first).cloned().collect()
    }
}

impl Event {
    /// The command that took effect, if one did.
    pub fn applied(&self) -> Option<&Command> {
        match &self.what {
            EventKind::Applied { command, .. } => Some(command),
            _ => None,
        }
    }

    /// The knob that was turned, and when, if one was.
    pub fn knob(&self) -> Option<TimedKnob> {
        match self.applied()? {
            Command::Set(knob) => Some(TimedKnob {
                at: self.at,
                knob: knob.clone(),
            }),
            _ => None,
        }
    }

    /// The event as a command to give again, if it changed what the graph
    /// computes: a run on the virtual clock with the same configuration and
    /// these commands is the same run.
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

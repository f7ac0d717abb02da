//! The log of commands and ends of a run.

use crate::{
    command::Command,
    event::{Event, EventKind},
    reexecution::Shared,
    time::Time,
};

/// The events of a run in order. Only rare events lock it, never a tick.
#[derive(Debug)]
pub(crate) struct EventLog(Shared<Vec<Event>>);

impl Default for EventLog {
    fn default() -> Self {
        Self(Shared::new("the event log", Vec::new()))
    }
}

impl EventLog {
    /// Adds an event; returns its position.
    pub(crate) fn note(&self, at: Time, what: EventKind) -> usize {
        let mut events = self.0.lock();
        events.push(Event { at, what });
        events.len() - 1
    }

    pub(crate) fn applied(&self, at: Time, command: &Command, was: Option<String>) -> usize {
        let command = command.clone();
        self.note(at, EventKind::Applied { command, was })
    }

    pub(crate) fn refused(&self, at: Time, command: &Command, reason: impl Into<String>) -> usize {
        let (command, reason) = (command.clone(), reason.into());
        self.note(at, EventKind::Refused { command, reason })
    }

    /// Logs a node's answer to `command`: the replaced value, or the reason for its
    /// refusal.
    pub(crate) fn answered(
        &self,
        at: Time,
        command: &Command,
        answer: Result<String, String>,
    ) -> usize {
        match answer {
            Ok(was) => self.applied(at, command, Some(was)),
            Err(reason) => self.refused(at, command, reason),
        }
    }

    /// The events from number `first` on.
    pub(crate) fn since(&self, first: usize) -> Vec<Event> {
        self.0.aside().iter().skip(first).cloned().collect()
    }
}

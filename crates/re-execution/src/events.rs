//! The events of the recorded run.

use std::collections::BTreeSet;

use ratelab::{Command, Event, EventKind, Time};

/// The events of the recorded run, then the first events of a branch.
#[derive(Debug)]
pub(crate) struct RecordedEvents {
    pub(crate) all: Vec<Event>,
    /// Positions of the events that happened under the real clock.
    pub(crate) known: BTreeSet<usize>,
    /// Of these, commands that are refused again without a try.
    pub(crate) refused: BTreeSet<usize>,
}

impl RecordedEvents {
    /// Adds a command for run time `at`; returns its position.
    pub(crate) fn add(&mut self, at: Time, command: Command) -> usize {
        let what = EventKind::Applied { command, was: None };
        self.all.push(Event { at, what });
        self.all.len() - 1
    }

    /// Returns the command at a position, with the reason if it is to be refused as recorded.
    pub(crate) fn command(&self, event: usize) -> Option<(&Command, Option<&str>)> {
        match &self.all.get(event)?.what {
            EventKind::Applied { command, .. } => Some((command, None)),
            EventKind::Refused { command, reason } => {
                let again = self.refused.contains(&event);
                Some((command, again.then_some(&**reason)))
            }
            _ => None,
        }
    }
}

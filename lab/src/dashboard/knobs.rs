//! The knobs of a session: as the graph has them, and as keys turned them since.

use ratelab::{Command, Event, EventKind, Knob};
use ratelab_study::system::Setup;

/// Knobs that were turned, before the run and during it.
#[derive(Default)]
pub struct Knobs {
    /// The knobs of the graph, by its events.
    running: Setup,
    /// Turned by keys and not yet answered by the graph, oldest first.
    pending: Vec<Knob>,
}

impl Knobs {
    /// Those of a run that begins with `setup`.
    pub fn new(setup: Setup) -> Self {
        Self {
            running: setup,
            pending: Vec::new(),
        }
    }

    /// The knobs of the graph with those on their way to it.
    pub fn wanted(&self) -> Setup {
        let mut wanted = self.running.clone();
        wanted.extend(self.pending.iter().cloned());
        wanted
    }

    /// A key turned `knob` of a running graph.
    pub fn press(&mut self, knob: Knob) {
        self.pending.push(knob);
    }

    /// A key turned `knob` for the next run.
    pub fn set(&mut self, knob: Knob) {
        self.running.set(knob);
    }

    /// Follows what the graph did with a knob, be it one that a key turned or one
    /// that was given its time up front; why it refused, if a key asked for it.
    pub fn follow(&mut self, event: &Event) -> Option<String> {
        match &event.what {
            EventKind::Applied {
                command: Command::Set(knob),
                ..
            } => {
                self.answered(knob);
                self.running.set(knob.clone());
                None
            }
            EventKind::Refused {
                command: Command::Set(knob),
                reason,
            } => self.answered(knob).then(|| format!("{knob}: {reason}")),
            _ => None,
        }
    }

    /// Takes `knob` from those that wait for an answer, if it is the first of its
    /// kind there. A timed knob of the same value may be taken for it: the one that
    /// a key turned then comes later, and sets that value all the same.
    fn answered(&mut self, knob: &Knob) -> bool {
        let first = self.pending.iter().position(|other| other.is_of(knob));
        let first = first.filter(|index| self.pending[*index] == *knob);
        first.map(|index| self.pending.remove(index)).is_some()
    }
}

//! The settings of a graph before its run.

use std::time::Duration;

use ratelab::{Depth, Hz, Knob, KnobKind};
use serde::{Deserialize, Serialize};

/// Knobs set before the run begins. All others keep the system's defaults.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Setup(Vec<Knob>);

impl Setup {
    /// Sets `knob`, in place of an earlier value. A crash or a restart has none: it comes
    /// after all that was set before.
    pub fn set(&mut self, knob: Knob) {
        if knob.kind().has_no_value() {
            self.0.retain(|known| !known.is_of(&knob));
        }
        match self.0.iter_mut().find(|known| known.is_of(&knob)) {
            Some(known) => *known = knob,
            None => self.0.push(knob),
        }
    }

    /// Returns the setup with `knob` set.
    #[must_use]
    pub fn with(mut self, knob: Knob) -> Self {
        self.set(knob);
        self
    }

    /// Returns the knob of this `kind` for a [subject](Knob::subject), if it is set.
    pub fn knob(&self, kind: KnobKind, subject: &str) -> Option<&Knob> {
        self.0
            .iter()
            .find(|knob| knob.kind() == kind && knob.subject() == subject)
    }

    /// Returns the rate of `node`, if it is set.
    pub fn rate(&self, node: &str) -> Option<Hz> {
        match self.knob(KnobKind::Rate, node)? {
            Knob::Rate { hz, .. } => Some(*hz),
            _ => None,
        }
    }

    /// Offset of `node`, if it is set.
    pub fn offset(&self, node: &str) -> Option<Duration> {
        match self.knob(KnobKind::Offset, node)? {
            Knob::Offset { offset, .. } => Some(*offset),
            _ => None,
        }
    }

    /// Depth of `topic`, if it is set.
    pub fn depth(&self, topic: &str) -> Option<Depth> {
        match self.knob(KnobKind::Depth, topic)? {
            Knob::Depth { depth, .. } => Some(*depth),
            _ => None,
        }
    }

    /// Message to `node`, if one is set.
    pub fn message(&self, node: &str) -> Option<&str> {
        match self.knob(KnobKind::Send, node)? {
            Knob::Send { text, .. } => Some(text),
            _ => None,
        }
    }

    /// Parameter `name` of `node`, if it is set.
    pub fn parameter(&self, node: &str, name: &str) -> Option<&str> {
        match self.knob(KnobKind::Parameter, &format!("{node} {name}"))? {
            Knob::Parameter { value, .. } => Some(value),
            _ => None,
        }
    }

    /// Returns all knobs, in the order in which they were first set.
    pub fn iter(&self) -> impl Iterator<Item = &Knob> + Clone {
        self.0.iter()
    }
}

impl Extend<Knob> for Setup {
    fn extend<I: IntoIterator<Item = Knob>>(&mut self, knobs: I) {
        knobs.into_iter().for_each(|knob| self.set(knob));
    }
}

impl FromIterator<Knob> for Setup {
    fn from_iter<I: IntoIterator<Item = Knob>>(knobs: I) -> Self {
        let mut setup = Self::default();
        setup.extend(knobs);
        setup
    }
}

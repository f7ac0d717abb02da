//! The settings of a graph before its run.

use std::time::Duration;

use ratelab::{Depth, Hz, Knob};
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

    /// Rate of `node`, if it is set.
    pub fn rate(&self, node: &str) -> Option<Hz> {
        self.0.iter().find_map(|knob| match knob {
            Knob::Rate { node: of, hz } if of == node => Some(*hz),
            _ => None,
        })
    }

    /// Offset of `node`, if it is set.
    pub fn offset(&self, node: &str) -> Option<Duration> {
        self.0.iter().find_map(|knob| match knob {
            Knob::Offset { node: of, offset } if of == node => Some(*offset),
            _ => None,
        })
    }

    /// Depth of `topic`, if it is set.
    pub fn depth(&self, topic: &str) -> Option<Depth> {
        self.0.iter().find_map(|knob| match knob {
            Knob::Depth { topic: of, depth } if of == topic => Some(*depth),
            _ => None,
        })
    }

    /// Message to `node`, if one is set.
    pub fn message(&self, node: &str) -> Option<&str> {
        self.0.iter().find_map(|knob| match knob {
            Knob::Send { node: of, text } if of == node => Some(text.as_str()),
            _ => None,
        })
    }

    /// Parameter `name` of `node`, if it is set.
    pub fn parameter(&self, node: &str, name: &str) -> Option<&str> {
        self.0.iter().find_map(|knob| match knob {
            Knob::Parameter {
                node: of,
                name: known,
                value,
            } if of == node && known == name => Some(value.as_str()),
            _ => None,
        })
    }

    /// All knobs, in the order in which they were first set.
    pub fn iter(&self) -> impl Iterator<Item = &Knob> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crash_after_a_restart_comes_after_it() {
        let knobs = ["crash a", "restart a", "rate a 5", "crash a", "rate a 7"];
        let setup: Setup = knobs
            .iter()
            .map(|text| text.parse::<Knob>().expect("a knob"))
            .collect();
        let texts: Vec<String> = setup.iter().map(ToString::to_string).collect();
        assert_eq!(texts, ["restart a", "rate a 7", "crash a"]);
    }
}

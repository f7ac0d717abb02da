//! A name of a system's own for knobs.

use super::Setup;
use crate::runtime::{Knob, KnobError, KnobKind, TimedKnob};

/// A name of a system's own for one knob, or for several that are turned
/// together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Alias {
    /// The name, such as `control-hz`.
    pub name: &'static str,
    /// What is turned: kinds, and nodes or topics.
    pub knobs: &'static [(KnobKind, &'static str)],
    /// The value with which a run begins unless it is set.
    pub default: &'static str,
    /// Values to choose from, if they can be listed; others may be valid too.
    pub choices: &'static [&'static str],
    /// What it sets, for help.
    pub help: &'static str,
}

impl Alias {
    /// Its kind, which is that of all its knobs.
    pub fn kind(&self) -> KnobKind {
        self.knobs.first().map_or(KnobKind::Send, |(kind, _)| *kind)
    }

    /// The knobs, set to `value`.
    ///
    /// # Errors
    /// [`KnobError`] if they do not take the value.
    pub fn set(&self, value: &str) -> Result<Vec<Knob>, KnobError> {
        let knobs = self.knobs.iter();
        knobs.map(|(kind, of)| kind.set(of, value)).collect()
    }

    /// The value with which a run begins: as in `setup`, or else the default.
    /// Where its knobs are set to several values, that of the first.
    pub fn value(&self, setup: &Setup) -> String {
        let first = self.knobs.first().and_then(|(kind, of)| {
            let mut knobs = setup.iter();
            knobs.find(|knob| knob.kind() == *kind && knob.target() == *of)
        });
        first.map_or_else(|| self.default.to_owned(), Knob::value)
    }

    /// The value of the knobs at the beginning of `knobs`, if they are those of
    /// this alias and all have one value and one time.
    pub(super) fn value_of(&self, knobs: &[TimedKnob]) -> Option<String> {
        let turned = knobs.get(..self.knobs.len())?;
        let (first, value) = (turned.first()?, turned.first()?.knob.value());
        let same = |(turned, (kind, of)): (&TimedKnob, &(KnobKind, &str))| {
            let knob = &turned.knob;
            let known = knob.kind() == *kind && knob.target() == *of;
            known && turned.at == first.at && knob.value() == value
        };
        turned.iter().zip(self.knobs).all(same).then_some(value)
    }
}

//! A system's own name for knobs.

use ratelab::{Knob, KnobError, KnobKind, TimedKnob};

use super::Setup;

/// A system's own name for a knob, or for several with a common value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Alias {
    /// Name, such as `control-hz`.
    pub name: &'static str,
    /// The knobs: their kinds and [subjects](Knob::subject).
    pub knobs: &'static [(KnobKind, &'static str)],
    /// The default value.
    pub default: &'static str,
    /// The known values, if they can be listed; others may be valid too.
    pub choices: &'static [&'static str],
    /// Description for help texts.
    pub help: &'static str,
}

impl Alias {
    /// The kind of all its knobs.
    pub fn kind(&self) -> KnobKind {
        self.knobs.first().map_or(KnobKind::Send, |(kind, _)| *kind)
    }

    /// Returns the knobs, set to `value`.
    ///
    /// # Errors
    /// [`KnobError`] for an invalid value.
    pub fn set(&self, value: &str) -> Result<Vec<Knob>, KnobError> {
        let knobs = self.knobs.iter();
        knobs.map(|(kind, of)| kind.set(of, value)).collect()
    }

    /// The initial value: from `setup`, or else the default. If its knobs have several
    /// values, that of the first.
    pub fn value(&self, setup: &Setup) -> String {
        let first = self.knobs.first();
        let knob = first.and_then(|(kind, of)| setup.knob(*kind, of));
        knob.map_or_else(|| self.default.to_owned(), Knob::value)
    }

    /// The common value of the knobs at the beginning of `knobs`, if they are the knobs
    /// of this alias with one value and one time.
    pub(super) fn value_of(&self, knobs: &[TimedKnob]) -> Option<String> {
        let turned = knobs.get(..self.knobs.len())?;
        let (first, value) = (turned.first()?, turned.first()?.knob.value());
        let same = |(turned, (kind, of)): (&TimedKnob, &(KnobKind, &str))| {
            let knob = &turned.knob;
            let known = knob.kind() == *kind && knob.subject() == *of;
            known && turned.at == first.at && knob.value() == value
        };
        turned.iter().zip(self.knobs).all(same).then_some(value)
    }
}

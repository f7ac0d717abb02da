//! The push age of a frame, and its parts.

use std::time::Duration;

use ratelab::Topology;
pub use ratelab_experiment::cause::{AgeData, Strain};
use ratelab_metrics::AgeParts;

use super::sentence::sentence;

/// The parts of the age of the push in force.
#[derive(Clone, Debug, PartialEq)]
pub struct PushData {
    /// The current parts.
    pub sentence: PushSentence,
    /// The greatest reaction time lately.
    pub reaction: Option<Duration>,
    /// The recent mean of each of [`PARTS`].
    pub mean: [Duration; PARTS.len()],
}

/// What data do at the stages of an age, in order of occurrence: the glyph in the bar, and the
/// [word](ratelab_metrics::AgeStage::word).
pub const PARTS: [[&str; 2]; 5] = [
    ["?", UNKNOWN],
    ["▒", "waited"],
    ["█", "worked"],
    ["▄", "on links"],
    ["▓", "held"],
];

/// The word of a part of the chain that is not known.
pub const UNKNOWN: &str = "unknown";

/// The parts of an age in a sentence, whole and with the smallest parts merged.
#[derive(Clone, Debug, PartialEq)]
pub struct PushSentence(pub Vec<String>);

impl PushSentence {
    /// The parts that have no room in a line: the key i has them.
    const MORE: &str = "more (i)";

    /// Widths of the sentence (columns).
    const WIDTHS: [usize; 5] = [usize::MAX, 78, 64, 52, 38];

    /// Creates the sentence about `parts`.
    pub fn new(parts: &AgeParts, topology: &Topology) -> Self {
        let within = |room| sentence(parts, topology, room, Self::MORE);
        Self(Self::WIDTHS.map(within).into())
    }

    /// Returns the whole sentence.
    pub fn whole(&self) -> &str {
        self.0.first().map_or("", String::as_str)
    }

    /// Returns the longest one for which `fits` is true, or else the shortest.
    pub fn fitting(&self, fits: impl Fn(&str) -> bool) -> &str {
        let fitting = self.0.iter().find(|text| fits(text));
        fitting.or(self.0.last()).map_or("", String::as_str)
    }
}

#[cfg(test)]
mod tests {
    use ratelab_metrics::AgeStage;

    use super::PARTS;

    #[test]
    fn every_stage_of_an_age_has_a_glyph() {
        for stage in [
            AgeStage::Before,
            AgeStage::Wait(0),
            AgeStage::Match { topic: 0, node: 0 },
            AgeStage::Executor(0),
            AgeStage::Queue(0),
            AgeStage::Reuse(0),
            AgeStage::Cost(0),
            AgeStage::Link(0),
            AgeStage::Held(0),
            AgeStage::Kept(0),
        ] {
            assert!(
                PARTS.iter().any(|[_, word]| *word == stage.word()),
                "{stage:?}"
            );
        }
    }
}

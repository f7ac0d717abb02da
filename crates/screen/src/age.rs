//! The push age of a frame: its position against the limits of the loop, and its parts.

use std::time::Duration;

use ratelab::{Time, Topology};
use ratelab_metrics::AgeParts;
use ratelab_system::AgeLimits;

use super::sentence::sentence;

/// Ages closer than this count as equal.
const HAIR: Duration = Duration::from_micros(100);

/// The recent push age and its limits.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AgeData {
    /// The mean push age over the last second, or over two periods of the policy.
    pub mean: Duration,
    /// The maximum push age in that time.
    pub greatest: Duration,
    /// That time, as a stretch of run time.
    pub stretch: (Time, Time),
    /// The mean part of it that a plan knew of; `None` without plans.
    pub predicted: Option<Duration>,
    /// The limits of the loop.
    pub limits: AgeLimits,
    /// Whether the screen hides them, because a learner is to find them.
    pub hidden: bool,
}

impl AgeData {
    /// Returns the mean part of the age that no plan knew of: the limits are for this.
    pub fn unpredicted(&self) -> Duration {
        self.mean.saturating_sub(self.predicted.unwrap_or_default())
    }

    /// Returns the position of the age against its limits, as far as the screen tells it.
    pub fn strain(&self) -> Strain {
        if self.hidden {
            return Strain::Hidden;
        }
        self.true_strain()
    }

    /// Returns the position of the age against its limits, hidden or not.
    pub fn true_strain(&self) -> Strain {
        // Where rates alone come to a limit, the mean is that limit: a constant age that is borne.
        let mean = self.unpredicted() + HAIR;
        let passed = |limit: Option<Duration>| limit.is_some_and(|limit| mean >= limit);
        let beyond = |falls: Duration| passed(Some(falls + 2 * HAIR));
        match self.limits {
            AgeLimits { falls, .. } if falls.is_some_and(beyond) => Strain::Falls,
            AgeLimits { may_fall, .. } if passed(may_fall) => Strain::MayFall,
            AgeLimits { grows, .. } if passed(grows) => Strain::Swings,
            limits if limits == AgeLimits::default() => Strain::Unknown,
            _ => Strain::Borne,
        }
    }

    /// Returns the limit above which the run is lost, or else the one at which small deviations
    /// grow.
    pub fn limit(&self) -> Option<Duration> {
        self.limits.falls.or(self.limits.grows)
    }

    /// That limit, or the band that it ends, as `number` writes an age; `None` where it is
    /// unknown or hidden.
    pub fn limit_text(&self, number: impl Fn(Duration) -> String) -> Option<String> {
        let limit = self.limit().filter(|_| !self.hidden).map(&number)?;
        let from = self.limits.may_fall.map(|from| number(from) + "–");
        Some(from.unwrap_or_default() + &limit)
    }
}

/// The position of a push age against its limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Strain {
    /// No known limit.
    Unknown,
    /// A limit that the screen hides.
    Hidden,
    /// Below the limits.
    Borne,
    /// Above the limit at which small deviations grow.
    Swings,
    /// In the band of ages with which some loops are lost.
    MayFall,
    /// Above that band.
    Falls,
}

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

//! The recent push age against the limits of the loop.

use std::time::Duration;

use ratelab::TimeSpan;
use ratelab_system::AgeLimits;

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
    pub stretch: TimeSpan,
    /// The mean part of it that a plan knew of; `None` without plans.
    pub predicted: Option<Duration>,
    /// The limits of the loop.
    pub limits: AgeLimits,
    /// Whether no text tells them, because a learner is to find them.
    pub hidden: bool,
}

impl AgeData {
    /// Returns the mean part of the age that no plan knew of: the limits are for this.
    pub fn unpredicted(&self) -> Duration {
        self.mean.saturating_sub(self.predicted.unwrap_or_default())
    }

    /// Returns the position of the age against its limits, as far as it may be told.
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
        Some(
            self.limits
                .may_fall
                .map(|from| number(from) + "–")
                .unwrap_or_default()
                + &limit,
        )
    }
}

/// The position of a push age against its limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Strain {
    /// No known limit.
    Unknown,
    /// A limit that no text tells.
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

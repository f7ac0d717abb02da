//! The additional delay of actions, and their age, at which small deviations begin to grow.

use std::time::Duration;

use ratelab::{Hz, hyper_period};

use super::{
    control_loop::{Loop, gains},
    error::StabilityError,
    monodromy::Stability,
    timing::{Cadence, Rates, Timing},
    world::WorldModel,
};
use crate::policy::PolicySpec;

/// Interval between the tested delays. A window of unstable delays that is narrower may
/// be missed.
const STEP: Duration = Duration::from_millis(1);

/// Accuracy of the margin.
const NEAR: Duration = Duration::from_nanos(100);

/// The longest delay tested. A loop that is stable even then has a plant that is stable
/// without its policy.
const LONGEST_DELAY: Duration = Duration::from_secs(2);

/// The margin of delay at which small deviations begin to grow.
#[derive(Clone, Debug, PartialEq)]
pub struct DelayMargin {
    /// The shortest delay of `/action` at which they do not shrink, to a tenth of a
    /// microsecond; zero if they never shrink.
    pub delay: Duration,
    /// Stability of the loop with that delay.
    pub there: Stability,
}

impl Loop {
    /// Returns the shortest delay of `/action`, all else equal, at which small deviations do not
    /// shrink: a search upwards from zero in steps of 1 ms, then bisection over the exact
    /// schedules. `None` if the loop is stable even at 2 s.
    ///
    /// # Errors
    /// [`StabilityError`], as for [`Loop::stability`].
    pub fn delay_margin(&self) -> Result<Option<DelayMargin>, StabilityError> {
        let mut stable = Duration::ZERO;
        let mut there = self.delayed(stable)?;
        if !there.is_stable() {
            let delay = stable;
            return Ok(Some(DelayMargin { delay, there }));
        }
        while there.is_stable() {
            stable += STEP;
            if stable > LONGEST_DELAY {
                return Ok(None);
            }
            there = self.delayed(stable)?;
        }
        let (mut stable, mut delay) = (stable - STEP, stable);
        while delay - stable > NEAR {
            let middle = stable + (delay - stable) / 2;
            let between = self.delayed(middle)?;
            if between.is_stable() {
                stable = middle;
            } else {
                (delay, there) = (middle, between);
            }
        }
        Ok(Some(DelayMargin { delay, there }))
    }

    fn delayed(&self, action_delay: Duration) -> Result<Stability, StabilityError> {
        let mut delayed = *self;
        delayed.timing.action_delay = action_delay;
        delayed.stability()
    }
}

/// Returns the mean push age above which small deviations grow, for `policy` at these rates: that
/// of the loop with the shortest constant delay at which they grow, in continuous time. An action
/// is applied on delivery.
///
/// Where sensor and policy meet less often than once a second, the limit is that of rounded
/// rates, which from 7 Hz on is within a millisecond of the exact one.
///
/// If deviations grow even without a delay, it is the mean push age of the rates alone:
/// the limit is then exceeded at these rates for any delay.
///
/// # Errors
/// [`StabilityError`], with the reason.
pub fn age_limit(policy: &PolicySpec, rates: Rates) -> Result<Duration, StabilityError> {
    let gains = gains(policy, rates.control)?;
    let nearby = rates.meeting_soon();
    let timing = Timing {
        sensor: Cadence::new(nearby.sensor),
        ..Timing::direct(nearby.control)
    };
    let control = Loop::cart_pole(gains, WorldModel::Continuous, timing)?;
    let margin = control
        .delay_margin()?
        .ok_or_else(|| StabilityError::Boundless(policy.to_string()))?;
    Ok(margin.there.mean_push_age)
}

/// The longest hyper-period of an exact limit: the work grows with it, and a longer one
/// would take seconds.
const SOON: Duration = Duration::from_secs(1);

impl Rates {
    /// Returns the nearest rates that meet often, if these meet too seldom.
    fn meeting_soon(self) -> Self {
        if hyper_period([self.sensor, self.control]) > SOON {
            Self {
                sensor: rounded(self.sensor),
                control: rounded(self.control),
            }
        } else {
            self
        }
    }
}

/// Multiples of 1 Hz meet once a second; lower rates have few ticks in ten.
fn rounded(hz: Hz) -> Hz {
    let step = if hz.get() >= 10.0 { 1.0 } else { 0.1 };
    Hz::new((hz.get() / step).round() * step).unwrap_or(hz)
}

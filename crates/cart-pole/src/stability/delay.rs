//! The additional delay of actions at which small deviations begin to grow.

use std::time::Duration;

use super::{control_loop::Loop, error::StabilityError, monodromy::Stability};

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
    /// The shortest delay of `/action`, all else equal, at which small deviations do not
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

//! How much longer an action may be on its way until small deviations grow.

use std::time::Duration;

use super::{
    control_loop::Loop,
    monodromy::{Stability, StabilityError},
};

/// The delays that are tried lie so far apart. A window of unstable delays that
/// is narrower than this may be passed over.
const STEP: Duration = Duration::from_millis(1);

/// To how much the edge is found.
const NEAR: Duration = Duration::from_nanos(100);

/// The longest delay that is tried. A loop that bears more is not unstable
/// without its policy.
const LONGEST_DELAY: Duration = Duration::from_secs(2);

/// Where the growth of small deviations begins.
#[derive(Clone, Debug, PartialEq)]
pub struct DelayMargin {
    /// The shortest delay of `/action` at which they do not shrink, to a tenth
    /// of a microsecond; zero if none makes them shrink.
    pub delay: Duration,
    /// The loop with that delay.
    pub there: Stability,
}

impl Loop {
    /// The shortest delay of `/action`, all else as it is, at which small
    /// deviations do not shrink: from no delay upwards, in steps of 1 ms, then
    /// by bisection over the exact schedules. `None` if even 2 s are borne.
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

//! The age of an action at which small deviations begin to grow.

use std::time::Duration;

use ratelab::{Hz, hyper_period};

use super::{
    control_loop::Loop,
    error::StabilityError,
    gains::gains,
    timing::{Cadence, Rates, Timing},
    world::WorldModel,
};
use crate::policy::PolicySpec;

/// The mean push age above which small deviations grow, for `policy` at these rates: that
/// of the loop with the shortest constant delay at which they grow, in continuous time.
/// An action is applied on delivery.
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
    let rates = rates.meeting_soon();
    let timing = Timing {
        sensor: Cadence::new(rates.sensor),
        ..Timing::direct(rates.control)
    };
    let control = Loop::cart_pole(gains, WorldModel::Continuous, timing)?;
    let margin = control.delay_margin()?;
    let margin = margin.ok_or_else(|| StabilityError::Boundless(policy.to_string()))?;
    Ok(margin.there.mean_push_age)
}

/// The longest hyper-period of an exact limit: the work grows with it, and a longer one
/// would take seconds.
const SOON: Duration = Duration::from_secs(1);

impl Rates {
    /// The nearest rates that meet often, if these meet too seldom.
    fn meeting_soon(self) -> Self {
        match hyper_period([self.sensor, self.control]) > SOON {
            true => Self {
                sensor: rounded(self.sensor),
                control: rounded(self.control),
            },
            false => self,
        }
    }
}

/// Multiples of 1 Hz meet once a second; lower rates have few ticks in ten.
fn rounded(hz: Hz) -> Hz {
    let step = if hz.get() >= 10.0 { 1.0 } else { 0.1 };
    Hz::new((hz.get() / step).round() * step).unwrap_or(hz)
}

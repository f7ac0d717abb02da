//! The age of an action at which small deviations begin to grow.

use std::time::Duration;

use thiserror::Error;

use super::{
    control_loop::Loop,
    gains::{NoTheory, gains},
    monodromy::StabilityError,
    timing::{Cadence, Rates, Timing},
    world::World,
};
use crate::policy::PolicySpec;

/// The reason why there is no age limit.
#[derive(Clone, Debug, Error)]
pub enum NoLimit {
    /// The policy is no linear feedback.
    #[error(transparent)]
    Policy(#[from] NoTheory),
    /// The loop is beyond the scope of linear theory.
    #[error(transparent)]
    Stability(#[from] StabilityError),
    /// Deviations shrink at every tested delay.
    #[error("the policy {0} is stable at every tested delay")]
    Boundless(String),
}

/// The mean push age above which small deviations grow, for `policy` at these rates: that
/// of the loop with the shortest constant delay at which they grow, in continuous time.
/// An action is applied on delivery.
///
/// If deviations grow even without a delay, it is the mean push age of the rates alone:
/// the limit is then exceeded at these rates for any delay.
///
/// # Errors
/// [`NoLimit`], with the reason.
pub fn age_limit(policy: &PolicySpec, rates: Rates) -> Result<Duration, NoLimit> {
    let timing = Timing {
        sensor: Cadence::new(rates.sensor),
        ..Timing::direct(rates.control)
    };
    let gains = gains(policy, rates.control)?;
    let control = Loop::cart_pole(gains, World::Continuous, timing);
    let margin = control.map_err(StabilityError::from)?.delay_margin()?;
    let margin = margin.ok_or_else(|| NoLimit::Boundless(policy.to_string()))?;
    Ok(margin.there.mean_push_age)
}

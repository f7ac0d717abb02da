//! How old an action may be before small deviations grow.

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

/// There is no limit of age to tell.
#[derive(Clone, Debug, Error)]
pub enum NoLimit {
    /// The policy is no linear feedback.
    #[error(transparent)]
    Policy(#[from] NoTheory),
    /// The loop is too much for linear theory.
    #[error(transparent)]
    Stability(#[from] StabilityError),
    /// No delay that was tried makes deviations grow.
    #[error("the policy {0} bears every delay that was tried")]
    Boundless(String),
}

/// The mean push age from which on small deviations grow, for `policy` at these
/// rates: that of the loop with the shortest constant delay that makes them grow,
/// in continuous time. An action is applied when it is delivered.
///
/// Where they grow without a delay it is the mean push age that the rates alone
/// come to: then the limit is passed at these rates whatever the delay.
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

//! The reasons why theory has no answer.

use std::time::Duration;

use thiserror::Error;

use super::timing::{LONGEST, Rates};
use crate::{
    PlantError,
    policy::{LqrError, PolicyKind},
};

/// An error of linear theory.
#[derive(Clone, Debug, Error)]
pub enum StabilityError {
    /// The hyper-period is too long.
    #[error(
        "a sensor at {sensor} and a policy at {control} meet the plant only every {seconds} s: \
         linear theory is worked out up to {longest} s; use rates with fewer decimals",
        sensor = rates.sensor, control = rates.control,
        seconds = hyper_period.as_secs_f64(), longest = LONGEST.as_secs()
    )]
    Aperiodic {
        /// The rates.
        rates: Rates,
        /// The hyper-period.
        hyper_period: Duration,
    },
    /// Linearising the plant failed.
    #[error("the plant cannot be linearised: {0}")]
    Plant(#[from] PlantError),
    /// The policy ignores the state of the plant.
    #[error("the policy {0} does not answer to readings: their age is nothing to it")]
    Blind(PolicyKind),
    /// The policy is a network.
    #[error("the network {0} has no gains: measure its limit by a sweep of delays")]
    Network(String),
    /// The gains of the policy could not be computed.
    #[error(transparent)]
    Lqr(#[from] LqrError),
    /// Deviations shrink at every tested delay.
    #[error("the policy {0} is stable at every tested delay")]
    Boundless(String),
    /// A knob beyond the theory.
    #[error("{0} is not part of the theory")]
    Knob(String),
}

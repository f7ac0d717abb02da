//! The control loop for linear theory, its world and its errors.

use std::time::Duration;

use nalgebra::Matrix5;
use ratelab::{Hz, Time};
use thiserror::Error;

use super::{
    span::{Dynamics, Noise, Span, Weights},
    timing::{LONGEST, Rates, Timing},
};
use crate::{
    PlantError, SUBSTEPS, actuator_hz,
    policy::{Lqr, LqrError, PolicyKind, PolicySpec, Scripted},
};

/// A control loop with an unlimited motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loop {
    /// The plant.
    pub dynamics: Dynamics,
    /// Gains of the policy: an action is the sum of products with the state.
    pub gains: [f64; 4],
    /// The passage of the plant's time.
    pub world: WorldModel,
    /// Timing of the nodes and links.
    pub timing: Timing,
}

impl Loop {
    /// Creates a loop around the cart-pole.
    ///
    /// # Errors
    /// [`PlantError`] if MuJoCo refuses the model or is out of memory.
    pub fn cart_pole(
        gains: [f64; 4],
        world: WorldModel,
        timing: impl Into<Timing>,
    ) -> Result<Self, PlantError> {
        Ok(Self {
            dynamics: Dynamics::cart_pole()?,
            gains,
            world,
            timing: timing.into(),
        })
    }
}

/// Returns the gains of a policy with the initial control rate `control`, in the order of the
/// plant's state: cart position (1/m), pole angle (1/rad), cart velocity (s/m), pole velocity
/// (s/rad).
///
/// # Errors
/// [`StabilityError`] if it is not a linear feedback, with the reason.
pub fn gains(policy: &PolicySpec, control: Hz) -> Result<[f64; 4], StabilityError> {
    match policy {
        PolicySpec::BuiltIn(PolicyKind::Scripted) => Ok(Scripted::GAINS),
        PolicySpec::BuiltIn(PolicyKind::Lqr) => Ok(Lqr::at(control)?.gains()),
        PolicySpec::BuiltIn(kind @ (PolicyKind::Zero | PolicyKind::Random)) => {
            Err(StabilityError::Blind(*kind))
        }
        PolicySpec::File(_) => Err(StabilityError::Network(policy.name().to_owned())),
    }
}

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

/// The relation of the plant's time to the ticks of the nodes.
///
/// | world | a reading at `t` sees the state after | an action applied at `t` is the input from |
/// |---|---|---|
/// | course | the control steps that began before `t` | the control step that begins at `t` |
/// | own | ⌊t / step⌋ physics steps | the first physics step at or after `t` |
/// | continuous | `t` | `t` |
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WorldModel {
    /// Each tick of the actuator is one control step of the plant.
    Course,
    /// The plant advances by itself in physics steps of this length.
    Own(Duration),
    /// The plant is a differential equation.
    Continuous,
}

impl WorldModel {
    /// Returns the smallest unit of its time.
    pub(super) fn unit(self) -> Duration {
        match self {
            Self::Course => actuator_hz().period(),
            Self::Own(step) => step.max(Time::RESOLUTION),
            Self::Continuous => Time::RESOLUTION,
        }
    }

    /// Returns the number of units before the state that a reading at `time` sees.
    pub(super) fn sensed(self, time: Duration) -> u128 {
        match self {
            Self::Course => self.applied(time),
            Self::Own(_) | Self::Continuous => time.as_nanos() / self.unit().as_nanos(),
        }
    }

    /// Returns the number of units before an action applied at `time` comes into force.
    pub(super) fn applied(self, time: Duration) -> u128 {
        time.as_nanos().div_ceil(self.unit().as_nanos())
    }

    /// Returns the motion of the plant in `units`, which is the quickest part of their
    /// [`span`](Self::span).
    pub(super) fn motion(self, dynamics: &Dynamics, units: u64) -> Matrix5<f64> {
        match self {
            Self::Continuous => Span::motion(dynamics, self.seconds(units)),
            Self::Course | Self::Own(_) => {
                let (noise, weights) = (Noise::default(), Weights::default());
                self.span(dynamics, units, &noise, &weights).motion
            }
        }
    }

    /// Returns the effect of `units` on the plant.
    pub(super) fn span(
        self,
        dynamics: &Dynamics,
        units: u64,
        noise: &Noise,
        weights: &Weights,
    ) -> Span {
        let step = |step| Span::step(dynamics, step, noise, weights);
        match self {
            Self::Course => step(self.unit() / SUBSTEPS).times(units * u64::from(SUBSTEPS)),
            Self::Own(_) => step(self.unit()).times(units),
            Self::Continuous => Span::flow(dynamics, self.seconds(units), noise, weights),
        }
    }

    fn seconds(self, units: u64) -> f64 {
        units as f64 * self.unit().as_secs_f64()
    }
}

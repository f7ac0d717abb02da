//! The passage of the plant's time.

use std::time::Duration;

use nalgebra::Matrix5;
use ratelab::Time;

use super::{
    dynamics::Dynamics,
    span::{Noise, Span, Weights},
};
use crate::{SUBSTEPS, actuator_hz};

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

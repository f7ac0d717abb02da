//! Whose time the plant's time is.

use std::time::Duration;

use super::{
    criterion::{Noise, Weights},
    dynamics::Dynamics,
    span::Span,
};
use crate::{
    cartpole::{SUBSTEPS, actuator_hz},
    runtime::Time,
};

/// How the plant's time goes on while the nodes tick.
///
/// | world | a reading at `t` sees the state after | an action applied at `t` is the input from |
/// |---|---|---|
/// | course | the control steps that began before `t` | the control step that begins at `t` |
/// | own | ⌊t / step⌋ physics steps | the first physics step at or after `t` |
/// | continuous | `t` | `t` |
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum World {
    /// Each tick of the actuator is one control step of the plant.
    Course,
    /// The plant goes on by itself in physics steps of this length.
    Own(Duration),
    /// The plant is a differential equation.
    Continuous,
}

impl World {
    /// The smallest stretch of time that it knows.
    pub(super) fn unit(self) -> Duration {
        match self {
            Self::Course => actuator_hz().period(),
            Self::Own(step) => step.max(Time::TICK),
            Self::Continuous => Time::TICK,
        }
    }

    /// After how many units the state is the one that a reading at `time` sees.
    pub(super) fn sensed(self, time: Duration) -> u128 {
        match self {
            Self::Course => self.applied(time),
            Self::Own(_) | Self::Continuous => time.as_nanos() / self.unit().as_nanos(),
        }
    }

    /// Before which unit an action comes into force that is applied at `time`.
    pub(super) fn applied(self, time: Duration) -> u128 {
        time.as_nanos().div_ceil(self.unit().as_nanos())
    }

    /// What so many units do to the plant.
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
            Self::Continuous => {
                let seconds = units as f64 * self.unit().as_secs_f64();
                Span::flow(dynamics, seconds, noise, weights)
            }
        }
    }
}

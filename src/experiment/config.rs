//! What defines a run.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::knob::TimedKnob;
use crate::{
    policy::{PolicyContext, PolicyError, PolicyKind, PolicySpec},
    runtime::{ClockKind, Depth, Hz, Speed, Time},
};

/// Everything that a run depends on. Under the virtual clock the same
/// configuration is the same run, bit for bit.
///
/// ```
/// use ratelab::{experiment::Config, policy::PolicyKind, runtime::Hz};
///
/// let config = Config {
///     control_hz: Hz::new(4.0)?,
///     policy: PolicyKind::Lqr.into(),
///     knobs: vec!["5 sensor-hz 200".parse()?],
///     ..Config::default()
/// };
/// assert_eq!(config.end.as_secs_f64(), 10.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Config {
    /// Chooses the start, and the numbers of a random policy.
    pub seed: u64,
    /// The clock to begin with.
    pub clock: ClockKind,
    /// How fast virtual time passes.
    pub speed: Speed,
    /// When the run ends; [`Time::MAX`] for never.
    pub end: Time,
    /// How often the sensor publishes.
    pub sensor_hz: Hz,
    /// How often the policy decides.
    pub control_hz: Hz,
    /// How many messages `/obs` and `/action` keep.
    pub queue_depth: Depth,
    /// The policy.
    pub policy: PolicySpec,
    /// How much longer the policy thinks, in wall time.
    pub think: Duration,
    /// Changes to make on the way.
    pub knobs: Vec<TimedKnob>,
}

impl Config {
    /// The same run and no other: files are pinned to the content that they have
    /// now; see [`PolicySpec::pinned`].
    ///
    /// # Errors
    /// [`PolicyError`] if a policy cannot be had.
    pub fn pinned(self) -> Result<Self, PolicyError> {
        let knobs = self.knobs.into_iter().map(TimedKnob::pinned);
        Ok(Self {
            policy: self.policy.pinned()?,
            knobs: knobs.collect::<Result<_, _>>()?,
            ..self
        })
    }

    /// Every policy that the run needs: the first and those of its knobs.
    pub fn policies(&self) -> impl Iterator<Item = &PolicySpec> {
        std::iter::once(&self.policy).chain(self.knob_policies())
    }

    /// The policies of its knobs.
    pub(super) fn knob_policies(&self) -> impl Iterator<Item = &PolicySpec> {
        self.knobs.iter().filter_map(|timed| timed.knob.policy())
    }

    /// What its policies may depend on.
    pub fn policy_context(&self) -> PolicyContext {
        PolicyContext {
            seed: self.seed,
            control_hz: self.control_hz,
        }
    }
}

impl Default for Config {
    /// Seed 0, ten seconds of virtual time flat out, everything at 50 Hz, depth
    /// one, scripted.
    fn default() -> Self {
        let hz = super::actuator_hz();
        Self {
            seed: 0,
            clock: ClockKind::Virtual,
            speed: Speed::Unlimited,
            end: Time::from_nanos(10_000_000_000),
            sensor_hz: hz,
            control_hz: hz,
            queue_depth: Depth::ONE,
            policy: PolicyKind::Scripted.into(),
            think: Duration::ZERO,
            knobs: Vec::new(),
        }
    }
}

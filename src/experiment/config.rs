//! The configuration of a run.

use serde::{Deserialize, Serialize};

use crate::{
    runtime::{ClockKind, Knob, Speed, Time, TimedKnob},
    system::{BuildError, Setup, System, WorldKind},
};

/// Everything that a run of a system depends on. Under the virtual clock the same
/// configuration is the same run, bit for bit.
///
/// ```
/// use ratelab::{cartpole::CartPole, experiment::Config};
///
/// let config = Config {
///     knobs: CartPole::KNOBS.parse_list("5 sensor-hz 200")?,
///     ..CartPole::config("control-hz 4, policy lqr")?
/// };
/// assert_eq!(config.end.as_secs_f64(), 10.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Config {
    /// Chooses the start, and every number that is drawn by chance.
    pub seed: u64,
    /// The clock to begin with.
    pub clock: ClockKind,
    /// How fast virtual time passes.
    pub speed: Speed,
    /// When the run ends; [`Time::MAX`] for never.
    pub end: Time,
    /// Whether the plant waits for the robot.
    #[serde(default, skip_serializing_if = "WorldKind::is_course")]
    pub world: WorldKind,
    /// Knobs turned before the run begins.
    pub setup: Setup,
    /// Knobs to be turned during the run.
    pub knobs: Vec<TimedKnob>,
}

impl Config {
    /// The same run, its messages in the form in which they are recorded; see
    /// [`System::resolve`].
    ///
    /// # Errors
    /// [`BuildError::Setting`] if a message makes no sense to the system.
    pub fn resolved(&self, system: &dyn System) -> Result<Self, BuildError> {
        let mut resolved = self.clone();
        for knob in self.setup.iter() {
            let knob = resolve(system, self.seed, &self.setup, knob.clone())?;
            resolved.setup.set(knob);
        }
        for timed in &mut resolved.knobs {
            timed.knob = resolve(system, self.seed, &self.setup, timed.knob.clone())?;
        }
        Ok(resolved)
    }
}

fn resolve(system: &dyn System, seed: u64, setup: &Setup, knob: Knob) -> Result<Knob, BuildError> {
    let Knob::Send { node, text } = knob else {
        return Ok(knob);
    };
    let resolved = system.resolve(seed, setup, &node, &text);
    let text = resolved.map_err(BuildError::Setting)?;
    Ok(Knob::Send { node, text })
}

impl Default for Config {
    /// Seed 0, ten seconds of virtual time without pacing, everything as the
    /// system has it.
    fn default() -> Self {
        Self {
            seed: 0,
            clock: ClockKind::Virtual,
            speed: Speed::Unlimited,
            end: Time::from_nanos(10_000_000_000),
            world: WorldKind::Course,
            setup: Setup::default(),
            knobs: Vec::new(),
        }
    }
}

//! The plant of the cart-pole, and what disturbs it.

use std::{fmt, mem, str::FromStr};

use ratelab::{Chance, Hz, Message, Time};
use ratelab_system::{SharedWorld, StepMs, World};

use crate::{
    ParameterError,
    body::{Body, PlantError, SUBSTEPS},
    message::{Action, ControlStep, Fall, Observation, Pose},
};

/// The course's step of physics.
pub(super) const STEP: StepMs = StepMs::LONGEST;

/// That step (s).
const TIMESTEP_S: f64 = 0.01;

/// Control steps per second of plant time: one per [`SUBSTEPS`] time steps of
/// 10 ms.
pub const CONTROL_HZ: f64 = 1.0 / (TIMESTEP_S * SUBSTEPS as f64);

/// Returns the plant's own rate, which is fixed.
pub fn actuator_hz() -> Hz {
    // This constant is within the range of valid rates.
    Hz::new(CONTROL_HZ).expect("50 Hz is a rate")
}

/// A cart-pole in MuJoCo.
///
/// ```
/// use ratelab_cart_pole::{Action, CONTROL_HZ, Fall, Plant};
///
/// let mut plant = Plant::new(0)?;
/// // Left alone, the pole falls within two seconds.
/// while plant.fall().is_none() {
///     plant.step(Action::ZERO);
/// }
/// assert_eq!(plant.fall(), Some(Fall::Pole));
/// assert!((plant.steps() as f64) < 2.0 * CONTROL_HZ);
/// # Ok::<(), ratelab_cart_pole::PlantError>(())
/// ```
pub struct Plant {
    body: Body,
    disturbance: Disturbance,
    steps: u64,
    fall: Option<Fall>,
}

impl Plant {
    /// Creates a plant at the start for `seed`.
    ///
    /// # Errors
    /// [`PlantError`] if MuJoCo refuses the model or is out of memory.
    pub fn new(seed: u64) -> Result<Self, PlantError> {
        Ok(Self {
            body: Body::new(STEP, seed)?,
            disturbance: Disturbance::none(seed),
            steps: 0,
            fall: None,
        })
    }

    /// Places cart and pole near rest: four offsets, uniform within ±0.05, drawn in the
    /// order cart position, pole angle, cart velocity, pole velocity.
    pub fn reset(&mut self, seed: u64) {
        self.body.reset(seed);
        (self.steps, self.fall) = (0, None);
    }

    /// Returns the reading of a perfect sensor.
    pub fn observe(&self) -> Observation {
        self.body.observation
    }

    /// Applies `action` for one control step. Returns the kind of fall if the run is lost
    /// then.
    pub fn step(&mut self, action: Action) -> Option<Fall> {
        self.body.disturb(self.disturbance.force(self.steps));
        self.body.control_step(action);
        self.steps += 1;
        self.fall = self.pose().fall();
        self.fall
    }

    /// Pose of cart and pole.
    pub fn pose(&self) -> Pose {
        self.body.pose
    }

    /// Cart position (m) and hinge angle (rad, not wrapped).
    pub fn qpos(&self) -> [f64; 2] {
        self.body.qpos()
    }

    /// Cart velocity (m/s) and hinge velocity (rad/s).
    pub fn qvel(&self) -> [f64; 2] {
        self.body.qvel()
    }

    /// Control steps since the start.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Returns the kind of fall, if the run is lost.
    pub fn fall(&self) -> Option<Fall> {
        self.fall
    }
}

/// Returns the version of MuJoCo in use, such as `3.17.0`.
pub fn mujoco_version() -> &'static str {
    mujoco_rs::mujoco_version()
}

/// A plant that a sensor reads and an actuator pushes.
pub trait CartPlant: World {
    /// Returns the reading of a perfect sensor.
    fn observe(&self) -> Observation;

    /// Applies the newest `command` at run time `now`. Returns the control step that this makes of
    /// a plant which moves by that alone, and whether the run is lost with it.
    fn push(&mut self, now: Time, command: Option<Message<Action>>) -> Option<(ControlStep, bool)>;

    /// Sets the random force from run time `now` on; returns the one before.
    fn disturb(&mut self, now: Time, newtons: Newtons) -> Newtons;
}

impl CartPlant for Plant {
    fn observe(&self) -> Observation {
        self.body.observation
    }

    fn push(&mut self, now: Time, command: Option<Message<Action>>) -> Option<(ControlStep, bool)> {
        let action = command.map_or(Action::ZERO, |command| command.data);
        let sensed = command.and_then(|command| command.origin);
        let latency = sensed.map(|sensed| now.since(sensed));
        let is_lost = self.step(action).is_some();
        Some((self.body.result(self.steps, action, latency), is_lost))
    }

    fn disturb(&mut self, _: Time, newtons: Newtons) -> Newtons {
        mem::replace(&mut self.disturbance.newtons, newtons)
    }
}

impl World for Plant {
    const NAME: &'static str = "the plant";

    /// The actuator moves it, and nothing else.
    fn advance_to(&mut self, _: Time) {}
}

/// The plant, shared by sensor and actuator.
pub type SharedPlant = SharedWorld<Plant>;

/// A random force on the cart, another one in each control step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Disturbance {
    seed: u64,
    /// Standard deviation (N).
    pub(super) newtons: Newtons,
}

/// A standard deviation of forces (N): 0 to [`Newtons::MAX`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Newtons(f64);

impl Newtons {
    /// A hundred times what the motor has.
    const MAX: f64 = 1000.0;
}

impl fmt::Display for Newtons {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl FromStr for Newtons {
    type Err = ParameterError;

    fn from_str(text: &str) -> Result<Self, ParameterError> {
        let newtons: Option<f64> = text.trim().parse().ok();
        newtons
            .filter(|newtons| (0.0..=Self::MAX).contains(newtons))
            .map(Self)
            .ok_or_else(|| ParameterError::Disturbance {
                text: text.to_owned(),
                max: Self::MAX.to_string(),
            })
    }
}

impl Disturbance {
    /// None, until it is set.
    pub(super) fn none(seed: u64) -> Self {
        let newtons = Newtons(0.0);
        Self { seed, newtons }
    }

    /// Returns this disturbance with another standard deviation.
    pub(super) fn with(self, newtons: Newtons) -> Self {
        Self { newtons, ..self }
    }

    /// Returns whether there is none.
    pub(super) fn is_none(&self) -> bool {
        self.newtons.0 == 0.0
    }

    /// Returns the force in control step number `step`, counted from zero (N).
    pub(super) fn force(&self, step: u64) -> f64 {
        if self.is_none() {
            return 0.0;
        }
        let chance = Chance {
            seed: self.seed,
            what: "disturb",
            name: "plant",
        };
        self.newtons.0 * chance.normal(step)
    }
}

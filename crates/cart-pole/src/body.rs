//! Cart and pole in MuJoCo: positions, velocities, and one step of physics.

use std::{
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

use mujoco_rs::prelude::{MjData, MjModel};
use ratelab_study::system::StepMs;
use thiserror::Error;

use super::{
    message::{Action, ControlStep, Observation},
    pose::Pose,
    seeding::{generator, unit},
};

/// The model, with the course environment's masses, lengths and limits.
const MODEL: &str = include_str!("cartpole.xml");

/// The pole in it, from the hinge to the tip.
const POLE: &str = "fromto=\"0 0 0 0 0 1.0\"";

/// Bound of each of the four random offsets of a start (m, rad, m/s, rad/s).
pub(crate) const START_SPREAD: f64 = 0.05;

/// Indices of the two joints, in the order of the model.
const SLIDER: usize = 0;
const HINGE: usize = 1;

/// An error of MuJoCo while creating the plant.
#[derive(Clone, Debug, Error)]
#[error("MuJoCo could not set up the cart-pole: {0}")]
pub struct PlantError(String);

impl PlantError {
    fn new(why: impl std::fmt::Display) -> Self {
        Self(why.to_string())
    }
}

/// Cart and pole: pure physics, independent of the caller.
pub(super) struct Body {
    data: MjData<Arc<MjModel>>,
    /// Current pose, the basis of sensor readings: computed once per move, because it is
    /// read several times.
    pose: Pose,
    observation: Observation,
}

impl Body {
    /// Cart and pole at the start for `seed`.
    pub(super) fn new(step: StepMs, seed: u64) -> Result<Self, PlantError> {
        let mut body = Self::of(Cart::plant(step))?;
        body.reset(seed);
        Ok(body)
    }

    /// Cart and pole at upright rest in the middle of the rail.
    pub(super) fn of(cart: Cart) -> Result<Self, PlantError> {
        let pose = Pose::of([0.0, 0.0]);
        Ok(Self {
            data: at_rest(cart)?,
            observation: Observation::of(pose, [0.0, 0.0]),
            pose,
        })
    }

    /// Places cart and pole near rest: four offsets, uniform within ±0.05, drawn in the
    /// order cart position, pole angle, cart velocity, pole velocity.
    pub(super) fn reset(&mut self, seed: u64) {
        let mut random = generator(&[seed]);
        let mut offset = || -START_SPREAD + (START_SPREAD - -START_SPREAD) * unit(&mut random);
        self.data.reset();
        self.data.qpos_mut()[SLIDER] = offset();
        self.data.qpos_mut()[HINGE] = offset();
        self.data.qvel_mut()[SLIDER] = offset();
        self.data.qvel_mut()[HINGE] = offset();
        self.data.forward();
        self.look();
    }

    /// Places cart and pole as in a `reading`, with nothing left of what was before.
    pub(super) fn place(&mut self, reading: &Observation) {
        let [x, v, cos, sin, omega] = reading.to_array().map(f64::from);
        self.data.reset();
        self.data.qpos_mut()[SLIDER] = x;
        self.data.qpos_mut()[HINGE] = sin.atan2(cos);
        self.data.qvel_mut()[SLIDER] = v;
        self.data.qvel_mut()[HINGE] = omega;
        self.look();
    }

    /// Has this force (N) act on the cart from now on, beside that of the motor.
    pub(super) fn disturb(&mut self, force: f64) {
        self.data.qfrc_applied_mut()[SLIDER] = force;
    }

    /// Advances by `steps` steps of physics with the input `action`.
    pub(super) fn integrate(&mut self, action: Action, steps: u64) {
        self.data.ctrl_mut()[0] = f64::from(action.clipped().0);
        for _ in 0..steps {
            self.data.step();
        }
    }

    /// Updates the pose of cart and pole.
    pub(super) fn look(&mut self) {
        self.pose = Pose::of(self.qpos());
        self.observation = Observation::of(self.pose, self.qvel());
    }

    /// The result of control step number `step`, with `action` from a sensing `latency` before.
    pub(super) fn result(
        &self,
        step: u64,
        action: Action,
        latency: Option<Duration>,
    ) -> ControlStep {
        ControlStep {
            step,
            action: action.clipped(),
            latency,
            observation: self.observation,
            qpos: self.qpos(),
            qvel: self.qvel(),
        }
    }

    pub(super) fn pose(&self) -> Pose {
        self.pose
    }

    pub(super) fn observation(&self) -> Observation {
        self.observation
    }

    /// Cart position (m) and hinge angle (rad, not wrapped).
    pub(super) fn qpos(&self) -> [f64; 2] {
        let qpos = self.data.qpos();
        [qpos[SLIDER], qpos[HINGE]]
    }

    /// Cart velocity (m/s) and hinge velocity (rad/s).
    pub(super) fn qvel(&self) -> [f64; 2] {
        let qvel = self.data.qvel();
        [qvel[SLIDER], qvel[HINGE]]
    }
}

/// What a model of cart and pole depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cart {
    step: StepMs,
    /// Length of the pole (m).
    pole: f64,
}

impl Cart {
    /// The plant, with this step of physics.
    pub(super) fn plant(step: StepMs) -> Self {
        Self { step, pole: 1.0 }
    }

    /// A model of it with the course's step, and a pole that is so many times as long.
    pub(super) fn model(length: f64) -> Self {
        Self {
            pole: length,
            ..Self::plant(StepMs::LONGEST)
        }
    }
}

/// Cart and pole at upright rest in the middle of the rail, the model's default.
pub(super) fn at_rest(cart: Cart) -> Result<MjData<Arc<MjModel>>, PlantError> {
    MjData::try_new(model(cart)?).map_err(PlantError::new)
}

/// The model that all of this kind share: it is immutable, and loading it takes as long as
/// most of a run.
fn model(cart: Cart) -> Result<Arc<MjModel>, PlantError> {
    static LOADED: Mutex<Vec<(Cart, Arc<MjModel>)>> = Mutex::new(Vec::new());
    let mut loaded = LOADED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, model)) = loaded.iter().find(|(known, _)| *known == cart) {
        return Ok(model.clone());
    }
    let pole = format!("fromto=\"0 0 0 0 0 {}\"", cart.pole);
    let text = MODEL.replace(POLE, &pole);
    let mut model = MjModel::from_xml_string(&text).map_err(PlantError::new)?;
    model.opt_mut().timestep = cart.step.get() as f64 / 1e3;
    let model = Arc::new(model);
    loaded.push((cart, model.clone()));
    Ok(model)
}

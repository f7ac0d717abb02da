//! Cart and pole in MuJoCo: positions, velocities, and one step of physics.

use std::{
    sync::{Arc, Mutex},
    time::Duration,
};

use mujoco_rs::prelude::{MjData, MjModel};
use ratelab::sync::lock;
use ratelab_system::StepMs;
use thiserror::Error;

use super::{
    message::{Action, ControlStep, Observation, Pose},
    seeding::{generator, unit},
};

/// The model, with the course environment's masses, lengths and limits.
const MODEL: &str = include_str!("cartpole.xml");

/// The pole in it, from the hinge to the tip.
const POLE: &str = "fromto=\"0 0 0 0 0 1.0\"";

/// Physics steps in one control step.
pub const SUBSTEPS: u32 = 2;

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
    pub(super) pose: Pose,
    /// The reading of a perfect sensor there.
    pub(super) observation: Observation,
}

impl Body {
    /// Cart and pole at the start for `seed`.
    pub(super) fn new(step: StepMs, seed: u64) -> Result<Self, PlantError> {
        let mut body = Self::from_data(at_rest(step, 1.0)?);
        body.reset(seed);
        Ok(body)
    }

    /// Creates a model with the course's step, and a pole `length` times as long.
    pub(super) fn model(length: f64) -> Result<Self, PlantError> {
        Ok(Self::from_data(at_rest(StepMs::LONGEST, length)?))
    }

    fn from_data(data: MjData<Arc<MjModel>>) -> Self {
        let pose = Pose::new([0.0, 0.0]);
        Self {
            data,
            observation: Observation::new(pose, [0.0, 0.0]),
            pose,
        }
    }

    /// Places cart and pole near rest: four offsets, uniform within ±0.05, drawn in the
    /// order cart position, pole angle, cart velocity, pole velocity.
    pub(super) fn reset(&mut self, seed: u64) {
        let mut random = generator(&[seed]);
        let mut offset = || -START_SPREAD + (START_SPREAD - -START_SPREAD) * unit(&mut random);
        let [qpos, qvel] = [[offset(), offset()], [offset(), offset()]];
        self.set(qpos, qvel);
        self.data.forward();
        self.look();
    }

    /// Places cart and pole as in a `reading`, with nothing left of what was before.
    pub(super) fn place(&mut self, reading: &Observation) {
        let [x, v, cos, sin, omega] = reading.to_array().map(f64::from);
        self.set([x, sin.atan2(cos)], [v, omega]);
        self.look();
    }

    /// Sets positions and velocities of the two joints, and nothing else.
    fn set(&mut self, qpos: [f64; 2], qvel: [f64; 2]) {
        self.data.reset();
        for (place, joint) in [SLIDER, HINGE].into_iter().enumerate() {
            self.data.qpos_mut()[joint] = qpos[place];
            self.data.qvel_mut()[joint] = qvel[place];
        }
    }

    /// Applies this force (N) to the cart from now on, beside the motor's.
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

    /// Goes on for the time of one control step of the course.
    pub(super) fn control_step(&mut self, action: Action) {
        self.integrate(action, u64::from(SUBSTEPS));
        self.look();
    }

    /// Updates the pose of cart and pole.
    pub(super) fn look(&mut self) {
        self.pose = Pose::new(self.qpos());
        self.observation = Observation::new(self.pose, self.qvel());
    }

    /// Returns the result of control step number `step`, with `action` from a sensing `latency`
    /// before.
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

/// Cart and pole at upright rest in the middle of the rail, the model's default, with this step of
/// physics and this length of the pole (m).
pub(super) fn at_rest(step: StepMs, pole: f64) -> Result<MjData<Arc<MjModel>>, PlantError> {
    MjData::try_new(model((step, pole))?).map_err(PlantError::new)
}

/// Step of physics, and length of the pole (m).
type CartModel = (StepMs, f64);

/// Returns the model that all of this kind share: it is immutable, and loading it takes as long as
/// most of a run.
fn model(cart: CartModel) -> Result<Arc<MjModel>, PlantError> {
    static LOADED: Mutex<Vec<(CartModel, Arc<MjModel>)>> = Mutex::new(Vec::new());
    let mut loaded = lock(&LOADED);
    if let Some((_, model)) = loaded.iter().find(|(known, _)| *known == cart) {
        return Ok(model.clone());
    }
    let (step, pole) = cart;
    let pole = format!("fromto=\"0 0 0 0 0 {pole}\"");
    let text = MODEL.replace(POLE, &pole);
    let mut model = MjModel::from_xml_string(&text).map_err(PlantError::new)?;
    model.opt_mut().timestep = step.get() as f64 / 1e3;
    let model = Arc::new(model);
    loaded.push((cart, model.clone()));
    Ok(model)
}

//! Cart and pole in MuJoCo: positions, velocities, and one step of physics.

use std::{sync::OnceLock, time::Duration};

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

/// Bound of each of the four random offsets of a start (m, rad, m/s, rad/s).
const START_SPREAD: f64 = 0.05;

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
    data: MjData<&'static MjModel>,
    /// Current pose, the basis of sensor readings: computed once per move, because it is
    /// read several times.
    pose: Pose,
    observation: Observation,
}

impl Body {
    /// Cart and pole at the start for `seed`.
    pub(super) fn new(step: StepMs, seed: u64) -> Result<Self, PlantError> {
        let pose = Pose::of([0.0, 0.0]);
        let mut body = Self {
            data: at_rest(step)?,
            observation: Observation::of(pose, [0.0, 0.0]),
            pose,
        };
        body.reset(seed);
        Ok(body)
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

/// Cart and pole at upright rest in the middle of the rail, the model's default.
pub(super) fn at_rest(step: StepMs) -> Result<MjData<&'static MjModel>, PlantError> {
    MjData::try_new(model(step)?).map_err(PlantError::new)
}

/// The model shared by all plants with this step: it is immutable, and loading it takes
/// as long as most of a run.
fn model(step: StepMs) -> Result<&'static MjModel, PlantError> {
    type Loaded = OnceLock<Result<MjModel, PlantError>>;
    static LOADED: [Loaded; StepMs::ALL.len()] = [const { OnceLock::new() }; _];
    let place = StepMs::ALL.iter().position(|known| *known == step);
    LOADED[place.unwrap_or_default()]
        .get_or_init(|| {
            let mut model = MjModel::from_xml_string(MODEL).map_err(PlantError::new)?;
            model.opt_mut().timestep = step.get() as f64 / 1e3;
            Ok(model)
        })
        .as_ref()
        .map_err(Clone::clone)
}

//! The physics: a cart on a rail, a pole hinged to it, one motor.

use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use mujoco_rs::prelude::{MjData, MjModel};
use thiserror::Error;

use super::{
    message::{Action, Observation},
    pose::{Fall, Pose},
    seeding::{generator, unit},
};
use crate::runtime::Hz;

/// The model, with the course environment's masses, lengths and limits.
const MODEL: &str = include_str!("cartpole.xml");

/// Physics time step (s), from the model.
const TIMESTEP_S: f64 = 0.01;

/// Physics steps in one control step.
pub const SUBSTEPS: u32 = 2;

/// Control steps per second of plant time: one per [`SUBSTEPS`] time steps of
/// 10 ms.
pub const CONTROL_HZ: f64 = 1.0 / (TIMESTEP_S * SUBSTEPS as f64);

/// The plant's own rate, which is not a choice.
pub fn actuator_hz() -> Hz {
    // A constant within the range of rates.
    Hz::new(CONTROL_HZ).expect("50 Hz is a rate")
}

/// Bound of each of the four random offsets of a start (m, rad, m/s, rad/s).
const START_SPREAD: f64 = 0.05;

/// Where the coordinates of the two joints are, in the order of the model.
const SLIDER: usize = 0;
const HINGE: usize = 1;

/// MuJoCo could not set the plant up.
#[derive(Clone, Debug, Error)]
#[error("MuJoCo could not set up the cart-pole: {0}")]
pub struct PlantError(String);

/// A cart-pole in MuJoCo.
///
/// ```
/// use ratelab::cartpole::{Action, CONTROL_HZ, Fall, Plant};
///
/// let mut plant = Plant::new(0)?;
/// // Left alone, the pole falls within two seconds.
/// while plant.fall().is_none() {
///     plant.step(Action::ZERO);
/// }
/// assert_eq!(plant.fall(), Some(Fall::Pole));
/// assert!((plant.steps() as f64) < 2.0 * CONTROL_HZ);
/// # Ok::<(), ratelab::cartpole::PlantError>(())
/// ```
pub struct Plant {
    data: MjData<&'static MjModel>,
    /// Where cart and pole are, and what a sensor reads of it: computed once a
    /// step, asked for several times.
    pose: Pose,
    observation: Observation,
    steps: u64,
    fall: Option<Fall>,
}

impl Plant {
    /// A plant at the start that belongs to `seed`.
    ///
    /// # Errors
    /// [`PlantError`] if MuJoCo refuses the model or has no memory.
    pub fn new(seed: u64) -> Result<Self, PlantError> {
        let data = at_rest()?;
        let pose = Pose::of([0.0, 0.0]);
        let mut plant = Self {
            observation: Observation::of(pose, [0.0, 0.0]),
            pose,
            data,
            steps: 0,
            fall: None,
        };
        plant.reset(seed);
        Ok(plant)
    }

    /// Puts cart and pole near rest: four offsets, uniform within ±0.05, drawn
    /// in the order cart position, pole angle, cart velocity, pole velocity.
    pub fn reset(&mut self, seed: u64) {
        let mut random = generator(&[seed]);
        let mut offset = || -START_SPREAD + (START_SPREAD - -START_SPREAD) * unit(&mut random);
        self.data.reset();
        self.data.qpos_mut()[SLIDER] = offset();
        self.data.qpos_mut()[HINGE] = offset();
        self.data.qvel_mut()[SLIDER] = offset();
        self.data.qvel_mut()[HINGE] = offset();
        self.data.forward();
        self.look();
        (self.steps, self.fall) = (0, None);
    }

    /// What a perfect sensor reads.
    pub fn observe(&self) -> Observation {
        self.observation
    }

    /// Holds `action` for one control step. Says so if that lost the run.
    pub fn step(&mut self, action: Action) -> Option<Fall> {
        self.data.ctrl_mut()[0] = f64::from(action.clipped().0);
        for _ in 0..SUBSTEPS {
            self.data.step();
        }
        self.look();
        self.steps += 1;
        self.fall = self.pose.fall();
        self.fall
    }

    fn look(&mut self) {
        self.pose = Pose::of(self.qpos());
        self.observation = Observation::of(self.pose, self.qvel());
    }

    /// Where cart and pole are.
    pub fn pose(&self) -> Pose {
        self.pose
    }

    /// Cart position (m) and hinge angle (rad, not wrapped).
    pub fn qpos(&self) -> [f64; 2] {
        let qpos = self.data.qpos();
        [qpos[SLIDER], qpos[HINGE]]
    }

    /// Cart velocity (m/s) and hinge velocity (rad/s).
    pub fn qvel(&self) -> [f64; 2] {
        let qvel = self.data.qvel();
        [qvel[SLIDER], qvel[HINGE]]
    }

    /// Control steps since the start.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// How the run was lost, if it was.
    pub fn fall(&self) -> Option<Fall> {
        self.fall
    }
}

/// Cart and pole at upright rest in the middle of the rail, the model's default.
pub(super) fn at_rest() -> Result<MjData<&'static MjModel>, PlantError> {
    MjData::try_new(model()?).map_err(|e| PlantError(e.to_string()))
}

/// The one model that all plants share: it is never written to, and loading it
/// takes as long as most of a run.
fn model() -> Result<&'static MjModel, PlantError> {
    static LOADED: OnceLock<Result<MjModel, PlantError>> = OnceLock::new();
    LOADED
        .get_or_init(|| MjModel::from_xml_string(MODEL).map_err(|e| PlantError(e.to_string())))
        .as_ref()
        .map_err(Clone::clone)
}

/// The version of MuJoCo that is at work, such as `3.17.0`.
pub fn mujoco_version() -> &'static str {
    mujoco_rs::mujoco_version()
}

/// The plant as sensor and actuator share it.
#[derive(Clone)]
pub struct SharedPlant(Arc<Mutex<Plant>>);

impl SharedPlant {
    /// Shares `plant`.
    pub fn new(plant: Plant) -> Self {
        Self(Arc::new(Mutex::new(plant)))
    }

    /// The plant, for as long as the guard lives.
    pub fn lock(&self) -> MutexGuard<'_, Plant> {
        // A panic elsewhere is reported as that node's fault; the numbers are whole.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

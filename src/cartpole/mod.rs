//! The robot: a pole on a cart, in MuJoCo.
//!
//! ```text
//! sensor ──/obs──► policy ──/action──► actuator ──/state──►
//!    ▲                                     │
//!    └───────────────── plant ◄────────────┘
//! ```
//!
//! The sensor reads the plant, the actuator moves it, and neither knows the
//! other: the plant is what they share, topics are how they talk. `/state`
//! carries the result of each control step, for observers of the run.

mod linear;
mod message;
mod nodes;
mod picture;
mod plant;
pub mod policy;
mod pose;
mod seeding;
pub mod stability;
mod system;
mod table;

pub use linear::LinearPlant;
pub use message::{Action, ControlStep, Observation};
pub use nodes::{ACTUATOR, Actuator, NotFinite, POLICY, PolicyNode, SENSE_TO_ACT, SENSOR, Sensor};
pub use plant::{
    CONTROL_HZ, Plant, PlantError, SUBSTEPS, SharedPlant, actuator_hz, mujoco_version,
};
pub use pose::{CART_LIMIT_M, Fall, POLE_LIMIT_RAD, Pose};
pub use seeding::generator;
pub(crate) use seeding::unit;
pub use system::{ACTION, BROKEN_HZ, CartPole, OBS, STATE, pole_angle, verdict};

//! The robot: a pole on a cart, in MuJoCo.
//!
//! ```text
//! sensor ──/obs──► policy ──/action──► actuator ──/state──►
//!    ▲                                     │
//!    └───────────────── plant ◄────────────┘
//! ```
//!
//! The sensor reads the plant and the actuator moves it; they share the plant and
//! communicate through topics. `/state` carries the result of each control step, for
//! observers of the run.
//!
//! This is the course's world, which waits for the actuator. In a world of its own
//! ([`FreePlant`]) the plant is a node, moves by itself, and publishes on `/state`.
//!
//! Stands on `ratelab`, `ratelab-metrics`, `ratelab-experiment`, `ratelab-policy` and `ratelab-system`; begin with
//! [`CartPole`], a [`System`](ratelab_system::System). A new policy goes into [`policy`], what
//! theory says of a rate into [`stability`].

#![warn(clippy::print_stderr, clippy::print_stdout)]

mod aliases;
mod body;
pub mod chunk;
mod free_plant;
mod message;
mod nodes;
mod parameter_error;
mod picture;
mod plant;
pub mod policy;
mod seeding;
pub mod stability;
mod system;
mod table;
pub mod verdict;
mod wiring;

pub(crate) use body::START_SPREAD;
pub use body::{PlantError, SUBSTEPS};
pub use free_plant::{FreePlant, LinearPlant};
pub(crate) use message::MOTOR_N;
pub use message::{
    ACTION, Action, CART_LIMIT_M, ControlStep, Fall, OBS, Observation, POLE_LIMIT_RAD, Pose,
    SimilarReadings,
};
pub use nodes::{
    ACTUATOR, Actuator, NotFinite, OnStale, POLICY, PolicyNode, SENSE_TO_ACT, SENSOR, Sensor,
};
pub(crate) use nodes::{DISTURB, OBSERVE, SIMILAR};
pub use parameter_error::ParameterError;
pub(crate) use parameter_error::in_words;
pub use plant::{CONTROL_HZ, CartPlant, Plant, SharedPlant, actuator_hz, mujoco_version};
pub use seeding::generator;
pub(crate) use seeding::unit;
pub use system::{BROKEN_HZ, CartPole, STATE, pole_angle};

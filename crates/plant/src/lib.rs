//! Any robot of an MJCF file as a plant.
//!
//! ```text
//! MJCF ──► RobotModel ──► equilibrium ──► linear model ──► gains, theory
//!                              │                             │
//!                              └────────► RobotPlant ◄───────┘
//! ```
//!
//! The robot moves by itself, at the equilibrium next to a pose, and is held there by a controller that
//! is made from its model: sensor, policy and actuator around it make a [`System`](ratelab_system::System).
//!
//! Stands on `ratelab`, `ratelab-metrics`, `ratelab-policy` and `ratelab-system`; begin with [`RobotPlant`].

#![warn(clippy::print_stderr, clippy::print_stdout)]

mod aliases;
mod cascade;
mod decide;
mod defect;
mod disturbance;
mod encirclement;
mod files;
mod gains;
mod geoms;
mod graph;
mod hull;
mod late_loop;
mod law;
mod linear;
mod losses;
mod margins;
mod model;
mod model_error;
mod motion;
mod nodes;
mod picture;
mod planned;
mod reach;
mod reference;
mod robot;
mod rounding;
mod signals;
mod system;
mod tally;
mod target;
mod terms;
mod theory;
mod world;

use std::sync::Arc;

use mujoco_rs::prelude::{MjData, MjModel};

pub use cascade::{COMMAND, INNER_OBS};
pub use defect::PlantDefect;
pub use linear::LinearRobot;
pub use model::RobotModel;
pub use model_error::RobotModelError;
pub use nodes::{ACTION, ACTUATOR, POLICY};
pub use system::RobotPlant;
pub use theory::BearableDelay;

/// The state of a robot in MuJoCo.
pub(crate) type BodyData = MjData<Arc<MjModel>>;

//! A plant, linear feedback, and the time that lies between them.

use super::{dynamics::Dynamics, timing::Timing, world::World};
use crate::cartpole::PlantError;

/// A control loop without limits to its motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loop {
    /// The plant.
    pub dynamics: Dynamics,
    /// The policy: an action is the sum of products with the state.
    pub gains: [f64; 4],
    /// How the plant's time goes on.
    pub world: World,
    /// When everything happens.
    pub timing: Timing,
}

impl Loop {
    /// A loop around the cart-pole.
    ///
    /// # Errors
    /// [`PlantError`] if MuJoCo refuses the model or has no memory.
    pub fn cart_pole(
        gains: [f64; 4],
        world: World,
        timing: impl Into<Timing>,
    ) -> Result<Self, PlantError> {
        Ok(Self {
            dynamics: Dynamics::cart_pole()?,
            gains,
            world,
            timing: timing.into(),
        })
    }
}

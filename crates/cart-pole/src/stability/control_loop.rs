//! A plant and linear feedback, with the timing between them.

use super::{dynamics::Dynamics, timing::Timing, world::WorldModel};
use crate::PlantError;

/// A control loop with an unlimited motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loop {
    /// The plant.
    pub dynamics: Dynamics,
    /// Gains of the policy: an action is the sum of products with the state.
    pub gains: [f64; 4],
    /// The passage of the plant's time.
    pub world: WorldModel,
    /// Timing of the nodes and links.
    pub timing: Timing,
}

impl Loop {
    /// Creates a loop around the cart-pole.
    ///
    /// # Errors
    /// [`PlantError`] if MuJoCo refuses the model or is out of memory.
    pub fn cart_pole(
        gains: [f64; 4],
        world: WorldModel,
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

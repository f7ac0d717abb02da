//! A plant and linear feedback, with the timing between them.

use ratelab::Hz;

use super::{dynamics::Dynamics, error::StabilityError, timing::Timing, world::WorldModel};
use crate::{
    PlantError,
    policy::{Lqr, PolicyKind, PolicySpec, Scripted},
};

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

/// Returns the gains of a policy with the initial control rate `control`, in the order of the
/// plant's state: cart position (1/m), pole angle (1/rad), cart velocity (s/m), pole velocity
/// (s/rad).
///
/// # Errors
/// [`StabilityError`] if it is not a linear feedback, with the reason.
pub fn gains(policy: &PolicySpec, control: Hz) -> Result<[f64; 4], StabilityError> {
    match policy {
        PolicySpec::BuiltIn(PolicyKind::Scripted) => Ok(Scripted::GAINS),
        PolicySpec::BuiltIn(PolicyKind::Lqr) => Ok(Lqr::at(control)?.gains()),
        PolicySpec::BuiltIn(kind @ (PolicyKind::Zero | PolicyKind::Random)) => {
            Err(StabilityError::Blind(*kind))
        }
        PolicySpec::File(_) => Err(StabilityError::Network(policy.name().to_owned())),
    }
}

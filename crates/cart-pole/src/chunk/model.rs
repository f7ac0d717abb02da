//! The policy's own model of the plant.

use super::settings::ModelError;
use crate::{
    Action, Observation, PlantError, SUBSTEPS,
    body::{Body, Cart},
};

/// A cart-pole of the policy's own, by which it plans: with the course's step, and a pole
/// that may be longer or shorter than the plant's.
pub struct PlanModel(Body);

impl PlanModel {
    /// A model with this error.
    ///
    /// # Errors
    /// [`PlantError`] if MuJoCo refuses the model or is out of memory.
    pub fn new(error: ModelError) -> Result<Self, PlantError> {
        Ok(Self(Body::of(Cart::model(error.length))?))
    }

    /// Begins at a reading.
    pub fn begin(&mut self, reading: &Observation) {
        self.0.place(reading);
    }

    /// What a perfect sensor would read.
    pub fn observe(&self) -> Observation {
        self.0.observation()
    }

    /// Goes on for one action.
    pub fn step(&mut self, action: Action) {
        self.0.integrate(action, u64::from(SUBSTEPS));
        self.0.look();
    }
}

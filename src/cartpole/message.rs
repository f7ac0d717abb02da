//! What travels on the cart-pole's topics: plain data.

use std::time::Duration;

/// What the sensor measures, in single precision as a policy network reads it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Cart position on the rail (m).
    pub cart_position: f32,
    /// Cart velocity (m/s).
    pub cart_velocity: f32,
    /// Cosine of the pole's angle; 1 is upright.
    pub cos_theta: f32,
    /// Sine of the pole's angle; positive leans towards +x.
    pub sin_theta: f32,
    /// Pole angular velocity (rad/s).
    pub pole_velocity: f32,
}

impl Observation {
    /// The values in the order of the course: position, velocity, cosine,
    /// sine, angular velocity.
    pub fn to_array(self) -> [f32; 5] {
        [
            self.cart_position,
            self.cart_velocity,
            self.cos_theta,
            self.sin_theta,
            self.pole_velocity,
        ]
    }
}

/// A force on the cart as a share of the motor's 10 N, positive towards +x.
/// Beyond ±1 the plant clips.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Action(pub f32);

impl Action {
    /// No force.
    pub const ZERO: Self = Self(0.0);

    /// The share of the motor's force that can be applied.
    pub fn clipped(self) -> Self {
        Self(self.0.clamp(-1.0, 1.0))
    }
}

/// What one control step came to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControlStep {
    /// Number of the step, counted from one.
    pub step: u64,
    /// The action as applied, after clipping.
    pub action: Action,
    /// Age of the sensing that the action was derived from; `None` before the
    /// first action.
    pub latency: Option<Duration>,
    /// What a sensor would read after the step.
    pub observation: Observation,
    /// Cart position (m) and hinge angle (rad, not wrapped) after the step.
    pub qpos: [f64; 2],
    /// Cart velocity (m/s) and hinge velocity (rad/s) after the step.
    pub qvel: [f64; 2],
}

//! Linear feedback, the course's balancer.

use super::{Policy, feedback::feedback};
use crate::{Action, Observation};

/// Gain on the pole's angle (1/rad).
const ANGLE: f64 = 10.0;

/// Gain on the pole's angular velocity (s/rad).
const POLE_VELOCITY: f64 = 2.0;

/// Gain on the cart's position (1/m).
const CART_POSITION: f64 = 0.4;

/// Gain on the cart's velocity (s/m).
const CART_VELOCITY: f64 = 0.8;

/// Pushes the cart under the pole, and slightly back to the middle. The gains are the
/// course's; they hold the pole down to about 10 Hz.
#[derive(Clone, Copy, Debug)]
pub struct Scripted;

impl Scripted {
    /// The gains in the order of the plant's state: cart position, pole angle, cart
    /// velocity, pole velocity. The action is their sum of products with the state,
    /// before clipping.
    pub const GAINS: [f64; 4] = [CART_POSITION, ANGLE, CART_VELOCITY, POLE_VELOCITY];
}

impl Policy for Scripted {
    fn name(&self) -> &str {
        "scripted"
    }

    fn act(&mut self, observation: &Observation) -> Action {
        feedback(&Self::GAINS, observation)
    }
}

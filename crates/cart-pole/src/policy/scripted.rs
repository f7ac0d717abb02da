//! Linear feedback, the course's balancer.

use super::Policy;
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

/// The sum of products of `gains` with the plant's state (cart position, pole angle, cart
/// velocity, pole velocity), clipped to the motor's range.
pub(super) fn feedback(gains: &[f64; 4], observation: &Observation) -> Action {
    let [cart_position, angle, cart_velocity, pole_velocity] = gains;
    let theta = f64::from(observation.sin_theta).atan2(f64::from(observation.cos_theta));
    // The order of the terms affects the result, because sums of floats round.
    let push = angle * theta
        + pole_velocity * f64::from(observation.pole_velocity)
        + cart_position * f64::from(observation.cart_position)
        + cart_velocity * f64::from(observation.cart_velocity);
    Action(push.clamp(-1.0, 1.0) as f32)
}

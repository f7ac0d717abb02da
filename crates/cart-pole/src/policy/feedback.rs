//! Linear feedback, the basis of several policies.

use crate::{Action, Observation};

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

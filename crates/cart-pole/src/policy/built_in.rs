//! The policies without a file.

use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};
use strum::{Display, IntoStaticStr, VariantNames};
use thiserror::Error;

use super::Policy;
use crate::{Action, Observation, generator, unit};

/// The policies without a file.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Display, IntoStaticStr, VariantNames,
)]
#[strum(serialize_all = "lowercase")]
pub enum PolicyKind {
    /// Linear feedback: [`Scripted`](super::Scripted).
    Scripted,
    /// Linear feedback with gains from theory: [`Lqr`](super::Lqr).
    Lqr,
    /// No force.
    Zero,
    /// Any force, at random.
    Random,
}

impl PolicyKind {
    /// All kinds.
    pub const ALL: [Self; 4] = [Self::Scripted, Self::Lqr, Self::Zero, Self::Random];

    /// Returns the name in settings.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// What may be given as a policy, for errors.
pub(super) const EXPECTED: &str = "scripted, zero, random, lqr, a file of weights or a program";

/// An unknown policy.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{0:?} is not a policy: expected {EXPECTED}")]
pub struct UnknownPolicy(pub(super) String);

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

/// Returns the sum of products of `gains` with the plant's state (cart position, pole angle, cart
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

/// Applies no force: shows how fast an unattended pole falls.
#[derive(Clone, Copy, Debug)]
pub struct Zero;

impl Policy for Zero {
    fn name(&self) -> &str {
        "zero"
    }

    fn act(&mut self, _: &Observation) -> Action {
        Action::ZERO
    }
}

/// Separates the policy's random numbers from the numbers of the start, which use the same
/// seed.
const STREAM: u64 = 1;

/// Pushes uniformly between −1 and 1, reproducibly for each seed.
#[derive(Clone, Debug)]
pub struct Random(Pcg64);

impl Random {
    /// Draws from numpy's `default_rng([seed, 1])`.
    pub fn new(seed: u64) -> Self {
        Self(generator(&[seed, STREAM]))
    }
}

impl Policy for Random {
    fn name(&self) -> &str {
        "random"
    }

    fn act(&mut self, _: &Observation) -> Action {
        Action((2.0 * unit(&mut self.0) - 1.0) as f32)
    }
}

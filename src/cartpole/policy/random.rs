//! A policy that guesses.

use rand_pcg::Pcg64;

use super::Policy;
use crate::cartpole::{Action, Observation, generator, unit};

/// Sets the policy's stream of numbers apart from that of the start, which is
/// drawn from the same seed.
const STREAM: u64 = 1;

/// Pushes anywhere between −1 and 1, the same way for the same seed.
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

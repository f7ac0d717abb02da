//! A random policy.

use rand_pcg::Pcg64;

use super::Policy;
use crate::{Action, Observation, generator, unit};

/// Separates the policy's random numbers from those of the start, which use the same
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

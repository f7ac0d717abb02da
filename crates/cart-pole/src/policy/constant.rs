//! The policy that does nothing.

use super::Policy;
use crate::{Action, Observation};

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

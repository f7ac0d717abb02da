//! What is done to the world outside of a graph.

use super::time::Time;

/// Something that was done to the world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Push {
    /// Run time at which it was applied.
    pub at: Time,
    /// Run time of the sensing behind it.
    pub sensed: Time,
}

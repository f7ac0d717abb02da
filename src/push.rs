//! The effects of a graph on the world.

use super::time::Time;

/// An action applied to the world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Push {
    /// Run time of the application.
    pub at: Time,
    /// Run time of the sensing behind it.
    pub sensed: Time,
}

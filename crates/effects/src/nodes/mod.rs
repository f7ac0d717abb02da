//! A node in its schedule: when its ticks are due, what they take, by which clock.

pub mod cost;
pub mod local_clock;
pub mod own;
pub mod task;

//! A node in its schedule: when its ticks are due, and what they take.

pub mod own;
pub mod task;

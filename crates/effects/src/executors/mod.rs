//! Nodes that share threads: the kinds of executors, and the order of each.

pub mod callback;
pub mod dispatch;
mod events;
pub mod executor;
pub mod ordered;
mod preemptive;
mod windows;

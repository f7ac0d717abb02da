//! Nodes that share threads: the kinds of executors, and the order of each.
//!
//! # Another executor
//!
//! 1. A file here like `events.rs`, the shortest: a type with the trait `CallbackOrder` of
//!    `ordered.rs`. It hears which timers are due and which messages arrived, and names the callback
//!    that is called next. Threads, triggers, costs, faults and both clocks are common to all.
//! 2. A row in the table `KINDS` of `executor.rs`: the name that graph files use, its threads under
//!    the real clock, and the function that makes its order.

mod events;
pub(crate) mod executor;
pub(crate) mod ordered;
mod preemptive;
mod windows;

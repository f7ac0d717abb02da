//! Runs a graph on threads against the wall clock of a real machine.
//!
//! A node has a thread of its own, or the threads of its executor. Each sleeps to absolute deadlines,
//! measures how late it is, and asks the schedule of its task set for work by the rules of virtual
//! time; see [`ratelab::clock::Worker`]. What its clock answers goes into the journal of the run, so that
//! the run can be executed again.
//!
//! | file | idea |
//! |---|---|
//! | `clock.rs` | a run as stretches between pauses, each with threads of its own |
//! | `supervisor.rs` | the calling thread: commands, reports, the end |
//! | `wall_thread.rs` | a thread: look, work, wait |
//! | `mailbox.rs` | what ends a wait: a message, a command, a stop |
//! | `priority.rs` | real-time priority; cores that threads share, by priority or by deadline |
//!
//! Stands on `ratelab`, the core, as any clock does: it runs graphs through [`Clock`](ratelab::Clock).
//! Begin with `clock.rs`.

#![warn(clippy::print_stderr, clippy::print_stdout)]

mod clock;
mod mailbox;
mod priority;
mod supervisor;
mod wall_thread;

pub use clock::RealClock;
pub use priority::{RealtimeError, RealtimePriority, lower_priority};

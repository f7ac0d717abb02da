//! Executes a run of the real clock again, bit for bit.
//!
//! Nodes are functions of what they read. Two runs of the same graph on threads differ in only two
//! things: *what the clocks* of the threads answered, and *in which order* they took what they
//! share: schedules, links and draws follow from these. Both fit into a few bytes a tick, and a run
//! that keeps to them comes again to the bit.
//!
//! ```text
//! Journal of a graph ──► RunLog ──► Log ──► Section ──► Plan ──► ReExecution
//! ```
//!
//! * [`RunLog`] is the journal of a graph: it keeps the entries of all threads while the run goes
//!   on: looks for work and their ends, commands, and the end of each stretch. [`Log`] is the same
//!   as bytes.
//! * `Plan` puts whole entries in a row, and into *overlaps* where they really do. A log with a
//!   plan is an execution, so it cannot hang. Where no work is between its start and its end, the
//!   graph is at rest: there a branch can begin.
//! * [`ReExecution`] is a clock that plays the plan. An [`Overlap`] can be held between any two of its
//!   operations.
//!
//! Stands on `ratelab`, the core, by its hooks for journals, turns and clocks. Begin with
//! `log.rs` and `re_execution.rs`.

#![warn(clippy::print_stderr, clippy::print_stdout)]

mod log;
mod plan;
mod players;
mod re_execution;
mod section;
mod watch;

pub use log::{Log, LogError, LogPosition, RunLog};
pub use re_execution::ReExecution;
pub use section::{Overlap, OverlapOperation};
pub use watch::{BusyNode, Doing, Watch};

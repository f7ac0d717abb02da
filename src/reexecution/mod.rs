//! The order of a run under the real clock: noted while it runs, kept when it is executed
//! again.
//!
//! Nodes are functions of what they read. Two runs of the same graph on threads differ in
//! only two things: *when* each tick began, and *in which order* the threads took what
//! they share. Both fit into a few bytes a tick, and a run that keeps to them comes again
//! to the bit.
//!
//! ```text
//! Shared ── turns ──► Entry ──► RunLog ──► Log ──► Section ──► Plan ──► clock::Rerun
//! ```
//!
//! * [`Shared`] is a lock that counts its *turns*. A thread that notes its turns remembers
//!   for each of its operations which lock it took, and which turn that was: enough to
//!   order all operations again (Instant Replay, LeBlanc and Mellor-Crummey 1987; DejaVu,
//!   Choi and Srinivasan 1998; LEAP, Huang, Liu and Zhang 2010).
//! * `RunLog` keeps the entries of all threads while the run goes on: ticks, commands, and
//!   the end of each stretch. [`Log`] is the same as bytes.
//! * `Plan` puts whole ticks in a row, and into *knots* where ticks really overlap. A log
//!   with a plan is an execution, so it cannot hang; between two parts of the plan the
//!   graph is at rest.
//! * [`Rerun`](crate::Rerun) is a clock that plays the plan. A [`Knot`] can be held
//!   between any two of its operations.

mod bytes;
mod entry;
mod hold;
mod knot;
mod lock_name;
mod log;
mod plan;
mod run_log;
mod section;
mod shared;
mod thread;
mod turns;
mod watch;

pub use knot::{Knot, KnotOperation};
pub use log::{Log, LogError, LogPosition};
pub use shared::{Shared, Turn};
pub use watch::{BusyNode, Doing, Watch};

pub(crate) use entry::{End, Entry};
pub(crate) use hold::Hold;
pub(crate) use knot::KnotStep;
pub(crate) use plan::{Part, entries_of};
pub(crate) use run_log::{RunLog, Stream};
pub(crate) use section::{Section, Sections, Stretch};
pub(crate) use thread::Thread;
pub(crate) use turns::{Noter, TurnFollower, expect, finish_entry};

//! When nodes tick, and in which order: the same for both clocks.
//!
//! A [`Stage`] has the events to come of some nodes, and names the work that is next; whoever
//! asks does the work, and reports back. A node with a thread of its own ticks as soon as it is
//! due and free; those of an executor wait for its [`Scheduler`], which its [`Dispatch`] makes.

mod agenda;
mod dispatch;
mod own;
mod scheduler;
mod stage;

pub use dispatch::{Dispatch, Member, Threads};
pub(crate) use scheduler::{Assignment, Job};
pub use scheduler::{AtInstant, Call, Scheduler};
pub(crate) use stage::{Moment, Stage};

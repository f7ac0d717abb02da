//! When nodes tick, and in which order: the same for both clocks.
//!
//! A [`Stage`] has the events to come of some nodes, and names the work that is next; whoever
//! asks does the work, and reports back. A node with a thread of its own ticks as soon as it is
//! due and free; those of an executor wait for its [`Scheduler`].

mod agenda;
mod events;
mod groups;
mod own;
mod preemptive;
mod scheduler;
mod stage;
mod windows;

pub(crate) use scheduler::{Assignment, Job};
pub(crate) use stage::{Moment, Stage};

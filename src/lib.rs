//! Robot software as a graph of nodes at fixed rates.
//!
//! Start with [`runtime`]: the three primitives, Topic, Rate and Node, and the two clocks
//! that run them. It is independent of any robot. A [`system`] is a graph as a value, of
//! a robot or of anything else; an [`experiment`] is one run of it, configuration in and
//! summary out, and a sweep is many of them. [`cartpole`] is the system of the course:
//! its plant, its nodes, the [`policy`] that decides, and the [`stability`] that linear
//! theory predicts. A [`graph_file`] is a system without a line of code.
//!
//! The library is independent of terminals and recordings: those belong to the `ratelab`
//! command. It reads only one kind of file, the weights of a policy; [`mod@file`] reads
//! files within bounds, also for the command.

pub mod cartpole;
pub mod experiment;
pub mod file;
pub mod graph_file;
pub mod runtime;
pub mod system;

#[doc(no_inline)]
pub use cartpole::{policy, stability};

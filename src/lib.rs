//! Robot software as a graph of nodes at fixed rates.
//!
//! Start with [`runtime`]: the three primitives, Topic, Rate and Node, and the
//! two clocks that run them. It knows no robot. A [`system`] is a graph as a value, of a robot or of anything else; an
//! [`experiment`] is one run of it, configuration in and summary out, and a sweep is
//! many of them. [`cartpole`] is the system of the course: its plant, its nodes, the
//! [`policy`] that decides, and the [`stability`] that linear theory expects.
//!
//! The library knows no terminal and no recordings: those are the business of the
//! `ratelab` command. The one kind of file that it reads is the weights of a policy;
//! [`mod@file`] reads files within bounds, for the command too.

pub mod cartpole;
pub mod experiment;
pub mod file;
pub mod runtime;
pub mod system;

#[doc(no_inline)]
pub use cartpole::{policy, stability};

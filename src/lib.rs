//! Robot software as a graph of nodes at fixed rates.
//!
//! Start with [`runtime`]: the three primitives, Topic, Rate and Node, and the
//! two clocks that run them. It knows no robot. [`cartpole`] is one, built on
//! it; [`policy`] holds the policies that can balance it; [`experiment`] is one
//! run as a value, configuration in and summary out, and many of them as a sweep;
//! [`stability`] is what linear theory says before any of them is run.
//!
//! The library knows no terminal and no recordings: those are the business of the
//! `ratelab` command. The one kind of file that it reads is the weights of a policy;
//! [`mod@file`] reads files within bounds, for the command too.

pub mod cartpole;
pub mod experiment;
pub mod file;
pub mod policy;
pub mod runtime;
pub mod stability;

//! A graph as a value, and what can be learned by running it.
//!
//! A [`system`] builds its graph and describes how to show it: a robot, or anything else. An
//! [`experiment`] is one run of it, configuration in and summary out; a sweep is many runs, and
//! a hunt the search for one that fails; [`advise`] knows what could make its data younger. A
//! [`graph_file`] is a system without a line of code.
//!
//! Stands on `ratelab`, `ratelab-account`, `ratelab-real-clock` and
//! `ratelab-replay`; knows no robot, terminal or recording. Begin with [`system::System`]; a graph
//! that a program of the library builds is one as it is, by [`system::LibraryGraph`].

#![warn(clippy::print_stderr, clippy::print_stdout)]

pub mod advise;
pub mod experiment;
pub mod file;
pub mod graph_file;
pub mod measured;
pub mod system;

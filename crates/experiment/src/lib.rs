//! Runs of a system as values, and what can be learned from them.
//!
//! An [`Experiment`] is one run: configuration in, summary out. A [`sweep`] makes many runs, a
//! [`hunt`] searches for one that fails, [`advise`] tries what could make data younger, and [`cause`]
//! tells why a run is lost.
//! A [`Table`] prints figures.
//!
//! Stands on `ratelab`, `ratelab-metrics`, `ratelab-system`, `ratelab-real-clock` and
//! `ratelab-re-execution`; knows no robot and no recorder. Begin with [`Experiment`].

#![warn(clippy::print_stderr, clippy::print_stdout)]

pub mod advise;
mod ages;
mod candidates;
pub mod cause;
mod config;
mod experiment;
pub mod hunt;
pub mod millis;
pub mod parallel;
mod phases;
mod step_csv;
mod summary;
pub mod sweep;
mod table;
mod taps;

pub use ages::{AgeShare, RunAge, RunAges};
pub use config::Config;
pub use experiment::{Experiment, own_world};
pub use step_csv::StepWriter;
pub use summary::{MeanPushAge, Summary};
pub use table::{Column, Table};
pub use taps::Taps;

//! The command line, the lab, recordings and sweeps for any [`System`]: one line in the
//! `main` of your own crate provides them all.
//!
//! Stands on all other crates. `commands/` has the commands, on options (`cli/`),
//! `output/` and `sweep/`; `network/` has the commands for several processes. Begin with
//! `program.rs`.
//!
//! ```no_run
//! use std::process::ExitCode;
//!
//! use ratelab::{Flow, Tick};
//! use ratelab_system::{BuildError, Builder, System};
//!
//! /// Counts to a thousand.
//! struct Counter;
//!
//! impl System for Counter {
//!     fn name(&self) -> &str {
//!         "counter"
//!     }
//!
//!     fn build(&self, builder: &mut Builder<'_>) -> Result<(), BuildError> {
//!         let count = builder.internal_topic("/count");
//!         builder.node("counter", 100.0, 0, move |wiring| {
//!             let (count, mut number) = (wiring.publisher(&count), 0);
//!             move |tick: &mut Tick| {
//!                 number += 1;
//!                 tick.publish(&count, number);
//!                 if number < 1000 { Flow::Continue } else { Flow::End }
//!             }
//!         })
//!     }
//! }
//!
//! fn main() -> ExitCode {
//!     ratelab_lab::main(Counter)
//! }
//! ```

// Texts go through `output`, which makes them safe to print on a terminal, and survives one that is
// gone; these macros panic there.
#![warn(clippy::print_stderr, clippy::print_stdout)]

mod cli;
mod commands;
mod course;
mod error;
mod graph_file;
mod like;
#[cfg(feature = "network")]
mod network;
mod options;
mod output;
mod predictions;
mod program;
mod reading;
mod results;
mod screen;
mod signals;
mod summary;
mod sweep;
mod table;
mod trace;
mod usage_error;
mod web;
mod wrap;

use std::{env, process::ExitCode, sync::Arc};

use ratelab_cart_pole::{CartPole, policy::end_programs};
use ratelab_system::System;

use error::Error;
use program::Program;
pub use ratelab_recording::OtherRun;

/// Runs the whole command for `system`, with the program's arguments: the lab, `run`,
/// `sweep`, `replay`, `info`, `verify`, and the commands for help.
///
/// The exit code is 0 for success, 2 for bad input, 1 for an unfinished run, and 128 + n
/// after signal n.
pub fn main(system: impl System) -> ExitCode {
    exit(&Program::new(Arc::new(system), false))
}

/// Runs the `ratelab` command: the command for the cart-pole, with the exercises of the
/// course and the figures of linear theory.
pub fn course() -> ExitCode {
    exit(&Program::new(Arc::new(CartPole::default()), true))
}

/// Plays a run of `system` on another runtime in the dashboard if there is a terminal, and
/// compares every message and tick with the same run on this runtime: prints the
/// result. The exit code is 1 for a difference.
pub fn show_other_run(system: impl System, run: OtherRun) -> ExitCode {
    let system: Arc<dyn System> = Arc::new(system);
    exit_after(|| like::show(&system, run))
}

fn exit(program: &Program) -> ExitCode {
    exit_after(|| execute(program))
}

fn exit_after(work: impl FnOnce() -> Result<(), Error>) -> ExitCode {
    signals::prepare(signals::Messages {
        note: output::note,
        error: |why| output::error(&why),
        stopped_by: output::stopped_by,
        waits_for_reader: output::waits_for_reader,
    });
    let outcome = work();
    // A run that was left in a tick still waits for its answer.
    end_programs();
    if let Err(error) = &outcome {
        output::error(error);
    }
    if signals::exit_code().is_some() {
        // Threads that nobody waits for may still be at work.
        signals::end_at_once();
    }
    outcome.map_or_else(|error| error.exit_code(), |()| ExitCode::SUCCESS)
}

fn execute(program: &Program) -> Result<(), Error> {
    let args = cli::with_look(program, env::args_os());
    let (file, with, args) = cli::take_graph_file(args);
    let opened = file
        .map(|file| graph_file::open(program, &file, &with))
        .transpose()?;
    let program = opened.as_ref().unwrap_or(program);
    match cli::parse(program, args) {
        Ok(command) => commands::execute(program, command),
        Err(error) => usage_error::explain(&error),
    }
}

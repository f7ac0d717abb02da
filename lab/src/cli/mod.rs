//! The command line: what can be asked for.

mod examples;
mod exercise;
mod explain;
mod graph;
mod recordings;
mod run;
mod sweep;
mod values;

use std::path::PathBuf;

use clap::{Parser, Subcommand};
use clap_complete::Shell;

use crate::version;

pub use self::{
    examples::EXAMPLES,
    exercise::{ExerciseArgs, Wanted},
    explain::explain,
    graph::{ClockArg, GraphArgs},
    recordings::{InfoArgs, ReplayArgs, VerifyArgs},
    run::{LabArgs, RunArgs, ScreenArgs},
    sweep::SweepArgs,
};

/// Headings under which options are listed.
pub mod heading {
    /// Of what is run.
    pub const GRAPH: &str = "Graph";
    /// Of clocks and durations.
    pub const TIME: &str = "Time";
    /// Of what is written and printed.
    pub const OUTPUT: &str = "Output";
    /// Of how it is drawn.
    pub const SCREEN: &str = "Screen";
}

/// See why robot software is a graph of nodes at fixed rates: a MuJoCo
/// cart-pole, balanced by three nodes that only talk through topics.
#[derive(Debug, Parser)]
#[command(
    name = "ratelab",
    version = version::short(),
    long_version = version::long(),
    max_term_width = 100,
    args_conflicts_with_subcommands = true,
    after_help = examples::RATELAB
)]
pub struct Cli {
    /// What to do; the lab, if nothing is said.
    #[command(subcommand)]
    pub command: Option<Command>,

    /// Options of the lab.
    #[command(flatten)]
    pub lab: LabArgs,
}

/// What ratelab can do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Open the dashboard over a running graph (the same as no command).
    #[command(after_help = examples::LAB)]
    Lab(LabArgs),
    /// Run the graph without a dashboard and print what it came to.
    #[command(after_help = examples::RUN)]
    Run(RunArgs),
    /// Run rates, depths and seeds on all cores: how often does the pole stay up?
    #[command(after_help = examples::SWEEP)]
    Sweep(SweepArgs),
    /// Open a recording in the rerun viewer, or play it in the terminal.
    #[command(after_help = examples::REPLAY)]
    Replay(ReplayArgs),
    /// Print what is in a recording.
    #[command(after_help = examples::INFO)]
    Info(InfoArgs),
    /// Run recordings of the virtual clock again and compare every bit.
    #[command(after_help = examples::VERIFY)]
    Verify(VerifyArgs),
    /// Learn by predicting: list the exercises, do one, check what they promise.
    #[command(after_help = examples::EXERCISE)]
    Exercise(ExerciseArgs),
    /// Print the keys of the lab.
    Keys,
    /// Print what makes a shell complete ratelab's commands and options.
    #[command(after_help = examples::COMPLETIONS)]
    Completions {
        /// The shell.
        #[arg(value_name = "SHELL")]
        shell: Shell,
    },
    /// Print the manual page, or write one page per command.
    #[command(after_help = examples::MAN)]
    Man {
        /// Write the pages into this folder, which is made if need be.
        #[arg(value_name = "DIR")]
        folder: Option<PathBuf>,
    },
}

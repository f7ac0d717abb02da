//! What a graph is checked with.

use std::{num::NonZeroUsize, path::PathBuf};

use clap::Args;
use ratelab_experiment::sweep::Axis;

use super::{GraphArgs, heading, sweep::threads};

/// Options of a check: the runs, and where their results go.
#[derive(Debug, Args)]
pub struct CheckArgs {
    /// The graph.
    #[command(flatten)]
    pub graph: GraphArgs,

    /// A run for each of these seeds: a list or a range, such as 0..9 [default: --seed]
    #[arg(long, value_name = "LIST", conflicts_with = "seed", allow_hyphen_values = true, help_heading = heading::GRAPH)]
    pub seeds: Option<Axis<u64>>,

    /// Number of threads, without effect on the results [default: one per core]
    #[arg(long, value_name = "N", value_parser = threads, allow_hyphen_values = true, help_heading = heading::TIME)]
    pub threads: Option<NonZeroUsize>,

    /// Write the results to this file as JUnit XML, a test for each limit.
    #[arg(long, value_name = "FILE", help_heading = heading::OUTPUT)]
    pub junit: Option<PathBuf>,

    /// Print the results as JSON and nothing else.
    #[arg(long, help_heading = heading::OUTPUT)]
    pub json: bool,
}

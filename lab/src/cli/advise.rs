//! The arguments of advice.

use std::num::NonZeroUsize;

use clap::Args;

use super::{GraphArgs, heading, sweep::threads};

/// The options of advice, as of a run.
#[derive(Debug, Args)]
pub struct AdviseArgs {
    /// The graph.
    #[command(flatten)]
    pub graph: GraphArgs,

    /// Number of threads; the result is the same for any [default: one per core]
    #[arg(long, value_name = "N", value_parser = threads, allow_hyphen_values = true, help_heading = heading::TIME)]
    pub threads: Option<NonZeroUsize>,

    /// Print the result as JSON and nothing else.
    #[arg(long, help_heading = heading::OUTPUT)]
    pub json: bool,
}

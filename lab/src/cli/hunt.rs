//! What can be asked of a hunt.

use std::{num::NonZeroUsize, path::PathBuf, time::Duration};

use clap::Args;

use super::{GraphArgs, heading, sweep::threads, values};

/// Heading of the faults.
const BUDGET: &str = "Faults allowed, at most";

/// Options of a hunt: a run that goes well, and the faults that it may get.
#[derive(Debug, Args)]
#[command(next_help_heading = BUDGET)]
pub struct HuntArgs {
    /// The graph.
    #[command(flatten)]
    pub graph: GraphArgs,

    /// Number of messages of the topic that may be lost.
    #[arg(
        long,
        value_name = "N",
        default_value_t = 0,
        hide_default_value = true,
        allow_hyphen_values = true
    )]
    pub lose: usize,

    /// Total delay to spread over messages of the topic, in milliseconds, in parts of 10 ms,
    /// shorter ones for a fast topic.
    #[arg(long, alias = "delay_ms", value_name = "MS", value_parser = values::milliseconds, allow_hyphen_values = true)]
    pub delay_ms: Option<Duration>,

    /// The topic [default: the last topic that a node reads]
    #[arg(long, value_name = "TOPIC")]
    pub topic: Option<String>,

    /// Longest duration of one tick of a node, in milliseconds, in parts of 10 ms, shorter
    /// ones for a fast node.
    #[arg(long, value_name = "NODE=MS", value_parser = values::hang)]
    pub hang: Option<(String, Duration)>,

    /// Shift of the due times of a node in the whole run: up to this many milliseconds, in
    /// parts of 1 ms, shorter ones for a fast node.
    #[arg(long, value_name = "NODE=MS", value_parser = values::hang)]
    pub shift: Option<(String, Duration)>,

    /// Number of threads; the result is the same for any [default: one per core]
    #[arg(long, value_name = "N", value_parser = threads, allow_hyphen_values = true, help_heading = heading::TIME)]
    pub threads: Option<NonZeroUsize>,

    /// Write the faults to this file, for --knobs.
    #[arg(long, value_name = "FILE", help_heading = heading::OUTPUT)]
    pub save: Option<PathBuf>,

    /// Record the failed run to this file, which must be new.
    #[arg(long, value_name = "FILE", help_heading = heading::OUTPUT)]
    pub record: Option<PathBuf>,

    /// Print the result as JSON and nothing else.
    #[arg(long, help_heading = heading::OUTPUT)]
    pub json: bool,
}

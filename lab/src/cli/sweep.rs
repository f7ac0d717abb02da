//! Arguments of the commands with many runs: sweep, hunt, advise, margins and check.

use std::{num::NonZeroUsize, path::PathBuf, time::Duration};

use clap::{Args, ValueEnum};
use ratelab::Time;
use ratelab_experiment::sweep::{Axis, SweepAxis};

use super::{
    GraphArgs, heading,
    run::TimingArgs,
    system::SystemArgs,
    values::{self, ValueError, duration, phases, within},
};

/// The arguments of a sweep. Lists are written like 5,10,25 and ranges like 1..30 or
/// 1..30:0.5. Names with underscores are accepted too.
#[derive(Debug, Args)]
#[command(next_help_heading = heading::GRAPH)]
pub struct SweepArgs {
    /// Options of the system.
    #[command(flatten)]
    pub system: SystemArgs<SweepAxis>,

    /// Sweep any knob, such as "rate NODE" or "takes NODE", with a list or a range; {}
    /// is where the values go if that is not the end: "link TOPIC delay:{}". For takes and
    /// wakes 1..5 is one distribution, and 1..5:1 a range. Can be given several times.
    #[arg(long, num_args = 2, value_names = ["KNOB", "LIST"], allow_hyphen_values = true)]
    pub axis: Vec<String>,

    /// Turn a knob of all runs, such as "rate NODE HZ", "takes NODE SPEC" or "link TOPIC
    /// SPEC"; can be given several times.
    #[arg(long, value_name = "KNOB")]
    pub knob: Vec<String>,

    /// Seeds: a list or a range, such as 0..199. Without an axis all runs have one setting
    /// [default: 0..19]
    #[arg(long, value_name = "LIST", allow_hyphen_values = true)]
    pub seeds: Option<Axis<u64>>,

    /// Number of settings of the nodes' phases, drawn by seed 0: one more axis.
    #[arg(long, value_name = "N", value_parser = phases, allow_hyphen_values = true)]
    pub phases: Option<usize>,

    /// Run time of each in seconds [default: 10]
    #[arg(long, alias = "duration_s", value_name = "S", value_parser = duration, allow_hyphen_values = true, help_heading = heading::TIME)]
    pub duration_s: Option<Time>,

    /// The world and the machine.
    #[command(flatten)]
    pub timing: TimingArgs,

    /// Number of threads, without effect on the results [default: one per core]
    #[arg(long, value_name = "N", value_parser = threads, allow_hyphen_values = true, help_heading = heading::TIME)]
    pub threads: Option<NonZeroUsize>,

    /// Count the runs by what they have in common, whatever the axes are. age: mean
    /// push age in the last second of a run.
    #[arg(long, value_enum, value_name = "WHAT", hide_possible_values = true, help_heading = heading::OUTPUT)]
    pub by: Option<ByArg>,

    /// Add the mean ages of every chain and of the push, and of their parts, as columns.
    #[arg(long, help_heading = heading::OUTPUT)]
    pub parts: bool,

    /// Write one row per run to this file.
    #[arg(long, value_name = "FILE", help_heading = heading::OUTPUT)]
    pub csv: Option<PathBuf>,

    /// Write sweep.json into this folder, which is created if needed.
    #[arg(long, value_name = "DIR", help_heading = heading::OUTPUT)]
    pub out: Option<PathBuf>,

    /// Write curves to this .rrd file, which must be new, for the rerun viewer.
    #[arg(long, value_name = "FILE", help_heading = heading::OUTPUT)]
    pub record: Option<PathBuf>,

    /// Print the result as JSON and nothing else.
    #[arg(long, help_heading = heading::OUTPUT)]
    pub json: bool,

    /// Print the result as a table in Markdown.
    #[arg(long, conflicts_with_all = ["json", "by"], help_heading = heading::OUTPUT)]
    pub markdown: bool,

    /// Draw a heat map into this file.
    #[arg(long, value_name = "FILE", help_heading = heading::OUTPUT)]
    pub svg: Option<PathBuf>,

    /// Draw with ASCII characters only.
    #[arg(long, help_heading = heading::OUTPUT)]
    pub ascii: bool,
}

/// What runs are counted by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ByArg {
    /// How old the sensing behind their actions was.
    Age,
}

/// The maximum number of threads.
const MAX_THREADS: NonZeroUsize = NonZeroUsize::new(1_024).expect("it is not zero");

/// Returns a number of threads.
pub fn threads(text: &str) -> Result<NonZeroUsize, ValueError> {
    within(text, "threads", NonZeroUsize::MIN..=MAX_THREADS)
}

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
        value_parser = values::messages,
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

/// Options of margins: the robot, and the starts that it has to survive.
#[derive(Debug, Args)]
pub struct MarginsArgs {
    /// The graph.
    #[command(flatten)]
    pub graph: GraphArgs,

    /// A run for each of these seeds: a list or a range [default: 0..9]
    #[arg(long, value_name = "LIST", conflicts_with = "seed", allow_hyphen_values = true, help_heading = heading::GRAPH)]
    pub seeds: Option<Axis<u64>>,

    /// The share of the runs that have to go well, above 0 and up to 1.
    #[arg(long, value_name = "SHARE", default_value_t = 0.9, value_parser = values::share, allow_hyphen_values = true, help_heading = heading::GRAPH)]
    pub share: f64,

    /// Number of threads, without effect on the results [default: one per core]
    #[arg(long, value_name = "N", value_parser = threads, allow_hyphen_values = true, help_heading = heading::TIME)]
    pub threads: Option<NonZeroUsize>,

    /// Print the results as JSON and nothing else.
    #[arg(long, help_heading = heading::OUTPUT)]
    pub json: bool,
}

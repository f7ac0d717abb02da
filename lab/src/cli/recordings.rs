//! The arguments of commands for recordings.

use std::path::PathBuf;

use clap::Args;
use ratelab::Time;

use super::{ScreenArgs, values::duration};

/// The arguments of a replay.
#[derive(Debug, Args)]
pub struct ReplayArgs {
    /// The recording.
    #[arg(value_name = "FILE")]
    pub file: PathBuf,

    /// Play it in the terminal, in the panes of the lab, also where there is a viewer.
    #[arg(long)]
    pub terminal: bool,

    /// Options of the terminal.
    #[command(flatten)]
    pub screen: ScreenArgs,
}

/// The recording to describe.
#[derive(Debug, Args)]
pub struct InfoArgs {
    /// The recording.
    #[arg(value_name = "FILE")]
    pub file: PathBuf,

    /// Print it as JSON, with the figures of its run.
    #[arg(long)]
    pub json: bool,
}

/// The recordings to verify.
#[derive(Debug, Args)]
pub struct VerifyArgs {
    /// The recordings.
    #[arg(value_name = "FILE", required = true)]
    pub files: Vec<PathBuf>,

    /// Pause threads at random: a run of the real clock gives the same result.
    #[arg(long)]
    pub perturb: bool,

    /// Run the policy at this path again, if the recording names it, and compare its answers:
    /// they are taken from the recording otherwise.
    #[arg(long, value_name = "FILE")]
    pub ask_policy: Option<PathBuf>,

    /// Print the results as JSON.
    #[arg(long)]
    pub json: bool,
}

/// What is written as tables.
#[derive(Debug, Args)]
pub struct TableArgs {
    /// The recording.
    #[arg(value_name = "FILE")]
    pub file: PathBuf,

    /// The folder for the tables, which is created if needed [default: FILE without its ending]
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
}

/// What is written for Perfetto.
#[derive(Debug, Args)]
pub struct TraceArgs {
    /// The recording.
    #[arg(value_name = "FILE")]
    pub file: PathBuf,

    /// The trace to write [default: FILE with the ending .pftrace]
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
}

/// A recorded run, left at a moment with something changed.
#[derive(Debug, Args)]
pub struct BranchArgs {
    /// The recording.
    #[arg(value_name = "FILE")]
    pub file: PathBuf,

    /// Leave the recorded run at this run time (s), or at the last rest of its nodes before.
    #[arg(long, value_name = "S", value_parser = duration)]
    pub at: Time,

    /// Turn a knob there, such as "takes NODE 0" or "rate NODE HZ"; the names of options
    /// are knobs, too. May be repeated.
    #[arg(long, value_name = "KNOB", required = true)]
    pub knob: Vec<String>,

    /// End of the branch in run time (s) [default: the end of the recorded run].
    #[arg(long, value_name = "S", value_parser = duration)]
    pub duration_s: Option<Time>,

    /// Record the branch to this file, which must be new; without a name, to one named
    /// after the run, in ./recordings.
    #[arg(long, value_name = "FILE", num_args = 0..=1)]
    pub record: Option<Option<PathBuf>>,

    /// Print the results as JSON.
    #[arg(long)]
    pub json: bool,
}

/// The recordings, and the page.
#[derive(Debug, Args)]
pub struct ExportWebArgs {
    /// The recordings. Of several a slider chooses, in the order of the setting in which
    /// they differ.
    #[arg(value_name = "FILE", required = true)]
    pub files: Vec<PathBuf>,

    /// The page to write.
    #[arg(short, long, value_name = "FILE", default_value = "runs.html")]
    pub output: PathBuf,

    /// Draw the limits of the push age too, which a learner is to predict first.
    #[arg(long)]
    pub limits: bool,
}

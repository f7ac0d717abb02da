//! Arguments of the commands for recordings and bags.

use std::{ffi::OsString, fs, path::PathBuf};

use clap::Args;
use ratelab::Time;

use super::{ScreenArgs, values::duration};
use crate::program::Program;

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

/// What is written as MCAP.
#[derive(Debug, Args)]
pub struct ExportArgs {
    /// The recording.
    #[arg(value_name = "FILE")]
    pub file: PathBuf,

    /// The MCAP file to write [default: FILE with the ending .mcap]
    #[arg(short, long, value_name = "FILE")]
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

/// The bag to look at.
#[derive(Debug, Args)]
pub struct LookArgs {
    /// The bag: an MCAP file of ROS 2, a folder with its files, or a table of events (.csv) with
    /// the columns topic,log_ns and, where known, publish_ns,stamp_ns (header stamp),seq.
    #[arg(value_name = "BAG")]
    pub file: PathBuf,

    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,

    /// Draw when the messages of each topic came, and its gaps, into this SVG file.
    #[arg(long, value_name = "FILE")]
    pub svg: Option<PathBuf>,
}

/// The endings of bags.
const ENDINGS: [&str; 3] = ["mcap", "csv", "db3"];

/// `args` with the name of the command, if the first is a bag.
pub fn with_look(program: &Program, args: impl IntoIterator<Item = OsString>) -> Vec<OsString> {
    let mut args: Vec<OsString> = args.into_iter().collect();
    let Some(first) = args.get(1) else {
        return args;
    };
    let is_option = first.to_string_lossy().starts_with('-');
    // Most first arguments are names of commands: the definition of all takes milliseconds.
    let is_bag = !is_option && is_bag(&PathBuf::from(first));
    if is_bag && super::command(program).find_subcommand(first).is_none() {
        args.insert(1, "look".into());
    }
    args
}

/// Returns whether `path` has the ending of a bag, or is a folder with a file that has one.
fn is_bag(path: &PathBuf) -> bool {
    let has_ending = |path: &PathBuf| {
        let ending = path.extension().map(|ending| ending.to_string_lossy());
        ending.is_some_and(|ending| ENDINGS.contains(&&*ending))
    };
    let files = || fs::read_dir(path).into_iter().flatten().flatten();
    has_ending(path) || (path.is_dir() && files().any(|file| has_ending(&file.path())))
}

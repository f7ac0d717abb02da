//! The arguments of a branch.

use std::path::PathBuf;

use clap::Args;
use ratelab::Time;

use super::values::duration;

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

    /// End of the branch in run time (s) [default: that of the recorded run].
    #[arg(long, value_name = "S", value_parser = duration)]
    pub duration_s: Option<Time>,

    /// Record the branch to this file, which must be new; without a name, to one named
    /// after the run, in ./recordings.
    #[arg(long, value_name = "FILE", num_args = 0..=1)]
    pub record: Option<Option<PathBuf>>,
}

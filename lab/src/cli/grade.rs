//! The arguments of grading.

use std::path::PathBuf;

use clap::Args;

use super::heading;

/// The hand-ins, and where the result goes.
#[derive(Debug, Args)]
pub struct GradeArgs {
    /// The folder with one folder per learner, named after the learner. A hand-in is the
    /// file answers.toml of ratelab exercise, and any recordings (.rrd) of a rescue.
    #[arg(value_name = "DIR")]
    pub dir: PathBuf,

    /// Check the learners' numbers (--seed) against this file: a name and a number per
    /// line, such as anna,17.
    #[arg(long, value_name = "FILE")]
    pub roster: Option<PathBuf>,

    /// Write one row per prediction and per recording to this file.
    #[arg(long, value_name = "FILE", help_heading = heading::OUTPUT)]
    pub csv: Option<PathBuf>,

    /// Print the result as JSON and nothing else.
    #[arg(long, help_heading = heading::OUTPUT)]
    pub json: bool,
}

//! The arguments of commands for recordings.

use std::path::PathBuf;

use clap::Args;

use super::ScreenArgs;

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
}

/// The recordings to verify.
#[derive(Debug, Args)]
pub struct VerifyArgs {
    /// The recordings.
    #[arg(value_name = "FILE", required = true)]
    pub files: Vec<PathBuf>,

    /// Have threads pause at random: a run of the real clock comes back all the same.
    #[arg(long)]
    pub perturb: bool,
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

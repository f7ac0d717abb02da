//! What a sweep can be asked for.

use std::{num::NonZeroUsize, path::PathBuf};

use clap::{Args, ValueHint};
use ratelab::{
    experiment::{
        Config,
        sweep::{Axis, Sweep},
    },
    policy::Brain,
    runtime::{Depth, Hz, Time},
};

use crate::{
    cli::{duration, heading},
    error::Error,
};

/// What a sweep can be asked for. Lists are written like 5,10,25 and ranges
/// like 1..30 or 1..30:0.5. Names with underscores are accepted too.
#[derive(Debug, Args)]
#[command(next_help_heading = heading::GRAPH)]
pub struct SweepArgs {
    /// How often the policy decides: a list or a range (Hz), such as 1..30.
    #[arg(
        long,
        alias = "control_hz",
        value_name = "LIST",
        default_value = "1..30",
        allow_hyphen_values = true
    )]
    pub control_hz: Axis<Hz>,

    /// The starts: a list or a range, such as 0..199.
    #[arg(
        long,
        value_name = "LIST",
        default_value = "0..19",
        allow_hyphen_values = true
    )]
    pub seeds: Axis<u64>,

    /// How often the sensor publishes: a list or a range (Hz).
    #[arg(
        long,
        alias = "sensor_hz",
        value_name = "LIST",
        default_value = "50",
        allow_hyphen_values = true
    )]
    pub sensor_hz: Axis<Hz>,

    /// How many messages /obs and /action keep: a list or a range.
    #[arg(
        long,
        alias = "queue_depth",
        value_name = "LIST",
        default_value = "1",
        allow_hyphen_values = true
    )]
    pub queue_depth: Axis<Depth>,

    /// The brains, with commas in between: scripted, lqr, zero, random, or files of
    /// weights.
    #[arg(
        long,
        value_name = "LIST",
        default_value = "scripted",
        value_delimiter = ',',
        value_hint = ValueHint::FilePath
    )]
    pub policy: Vec<Brain>,

    /// Run time of each in seconds [default: 10]
    #[arg(long, alias = "duration_s", value_name = "S", value_parser = duration, allow_hyphen_values = true, help_heading = heading::TIME)]
    pub duration_s: Option<Time>,

    /// Threads to run on, which change nothing but the time it takes [default: one per core]
    #[arg(long, value_name = "N", value_parser = threads, allow_hyphen_values = true, help_heading = heading::TIME)]
    pub threads: Option<NonZeroUsize>,

    /// Put what linear theory says beside what was measured: how fast a small
    /// deviation grows (1/s).
    #[arg(long, help_heading = heading::OUTPUT)]
    pub theory: bool,

    /// Write one row per run to this file.
    #[arg(long, value_name = "FILE", help_heading = heading::OUTPUT)]
    pub csv: Option<PathBuf>,

    /// Write sweep.json into this folder, which is made if need be.
    #[arg(long, value_name = "DIR", help_heading = heading::OUTPUT)]
    pub out: Option<PathBuf>,

    /// Write curves over the control rate to this .rrd file, which must be new, for
    /// the rerun viewer.
    #[arg(long, value_name = "FILE", help_heading = heading::OUTPUT)]
    pub record: Option<PathBuf>,

    /// Print the result as JSON and nothing else.
    #[arg(long, help_heading = heading::OUTPUT)]
    pub json: bool,

    /// Draw with ASCII characters only.
    #[arg(long, help_heading = heading::OUTPUT)]
    pub ascii: bool,
}

impl SweepArgs {
    /// The sweep that the options describe.
    pub fn sweep(&self) -> Result<Sweep, Error> {
        let twice = |(place, policy)| self.policy[..place].contains(policy);
        if let Some((_, policy)) = self.policy.iter().enumerate().find(|entry| twice(*entry)) {
            let why = format!("--policy lists {policy} twice: give each brain once");
            return Err(Error::BadInput(why));
        }
        let policies = self.policy.iter().map(Brain::pinned);
        let policies = policies.collect::<Result<_, _>>();
        let policies = policies.map_err(|error| Error::BadInput(format!("--policy {error}")))?;
        let usual = Config::default();
        Ok(Sweep {
            policies,
            sensor_hz: self.sensor_hz.clone().into(),
            queue_depths: self.queue_depth.clone().into(),
            control_hz: self.control_hz.clone().into(),
            seeds: self.seeds.clone().into(),
            base: Config {
                end: self.duration_s.unwrap_or(usual.end),
                ..usual
            },
        })
    }
}

/// The most threads that are accepted.
const MOST_THREADS: usize = 1_024;

fn threads(text: &str) -> Result<NonZeroUsize, String> {
    let threads = text.trim().parse().ok();
    threads
        .filter(|threads: &NonZeroUsize| threads.get() <= MOST_THREADS)
        .ok_or_else(|| format!("expected 1 to {MOST_THREADS} threads"))
}

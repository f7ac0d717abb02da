//! What a sweep can be asked for.

use std::{num::NonZeroUsize, path::PathBuf, str::FromStr};

use clap::{Args, ValueHint};
use ratelab::{
    experiment::sweep::Axis,
    policy::{PolicySpec, UnknownPolicy},
    runtime::{Depth, Hz, Time},
};

use super::{
    heading,
    values::{duration, within},
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

    /// The policies, with commas in between: scripted, lqr, zero, random, or files of
    /// weights (a comma in a path is \,).
    #[arg(
        long,
        value_name = "LIST",
        default_value = "scripted",
        value_hint = ValueHint::FilePath
    )]
    pub policy: Vec<Policies>,

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

/// Several policies. As text they have commas in between; one that is part of a
/// path has a backslash before it.
#[derive(Clone, Debug)]
pub struct Policies(pub Vec<PolicySpec>);

impl FromStr for Policies {
    type Err = UnknownPolicy;

    fn from_str(text: &str) -> Result<Self, UnknownPolicy> {
        let mut names = vec![String::new()];
        for piece in text.split_inclusive(',') {
            let mut name = names.pop().unwrap_or_default();
            match (piece.strip_suffix("\\,"), piece.strip_suffix(',')) {
                (Some(start), _) => names.push(name + start + ","),
                (None, Some(end)) => names.extend([name + end, String::new()]),
                (None, None) => {
                    name.push_str(piece);
                    names.push(name);
                }
            }
        }
        let policies = names.iter().map(|name| name.parse());
        policies.collect::<Result<_, _>>().map(Self)
    }
}

/// The most threads that are accepted.
const MOST_THREADS: NonZeroUsize = NonZeroUsize::new(1_024).expect("it is not zero");

fn threads(text: &str) -> Result<NonZeroUsize, String> {
    within(text, "threads", NonZeroUsize::MIN..=MOST_THREADS)
}

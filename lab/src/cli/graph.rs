//! What a graph can be asked for.

use std::{path::PathBuf, time::Duration};

use clap::{Args, ValueEnum, ValueHint};
use ratelab::{
    policy::PolicySpec,
    runtime::{ClockKind, Depth, Hz, Speed, Time},
};

use super::{heading, values};

/// What a graph can be asked for. Names with underscores are accepted too.
#[derive(Debug, Args)]
#[command(next_help_heading = heading::GRAPH)]
pub struct GraphArgs {
    /// How often the policy decides (0.001 to 10000 Hz) [default: 50]
    #[arg(
        long,
        alias = "control_hz",
        value_name = "HZ",
        allow_hyphen_values = true
    )]
    pub control_hz: Option<Hz>,

    /// Break it: the policy decides only 5 times a second.
    #[arg(long = "break", conflicts_with = "control_hz")]
    pub break_bug: bool,

    /// How often the sensor publishes (0.001 to 10000 Hz).
    #[arg(
        long,
        alias = "sensor_hz",
        value_name = "HZ",
        default_value = "50",
        allow_hyphen_values = true
    )]
    pub sensor_hz: Hz,

    /// How many messages /obs and /action keep (1 to 1000000).
    #[arg(
        long,
        alias = "queue_depth",
        value_name = "N",
        default_value = "1",
        allow_hyphen_values = true
    )]
    pub queue_depth: Depth,

    /// The policy: scripted, lqr, zero, random, or a file of weights (.pt,
    /// .safetensors, .onnx).
    #[arg(
        long,
        value_name = "POLICY",
        default_value = "scripted",
        value_hint = ValueHint::FilePath
    )]
    pub policy: PolicySpec,

    /// Chooses the start, and the numbers of the random policy.
    #[arg(
        long,
        default_value_t = 0,
        value_name = "N",
        value_parser = values::seed,
        allow_hyphen_values = true
    )]
    pub seed: u64,

    /// Turn knobs on the way: a file with lines such as "2.5 control-hz 10"
    /// (control-hz, sensor-hz, queue-depth, policy).
    #[arg(long, value_name = "FILE")]
    pub knobs: Option<PathBuf>,

    /// real: one thread per node, against the wall clock. virtual: one thread, the
    /// same to the bit every time [default: real for run, virtual for the lab]
    #[arg(long, value_enum, value_name = "CLOCK", hide_possible_values = true, help_heading = heading::TIME)]
    pub clock: Option<ClockArg>,

    /// Run time in seconds [default: 10 for run, no end for the lab]
    #[arg(long, alias = "duration_s", value_name = "S", value_parser = values::duration, allow_hyphen_values = true, help_heading = heading::TIME)]
    pub duration_s: Option<Time>,

    /// How fast virtual time passes: max, or 0.1 to 100 times wall time
    /// [default: max for run, 1 for the lab]
    #[arg(long, value_name = "FACTOR", value_parser = values::speed, allow_hyphen_values = true, help_heading = heading::TIME)]
    pub speed: Option<Speed>,

    /// Have the policy think longer: milliseconds of wall time per decision
    /// (real clock only).
    #[arg(long, alias = "think_ms", value_name = "MS", value_parser = values::think, allow_hyphen_values = true, help_heading = heading::TIME)]
    pub think_ms: Option<Duration>,

    /// Ask for real-time scheduling and locked memory (real clock only).
    #[arg(long, help_heading = heading::TIME)]
    pub realtime: bool,
}

/// A clock by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ClockArg {
    /// One thread per node against the wall clock.
    Real,
    /// One thread, reproducible to the bit.
    Virtual,
}

impl From<ClockArg> for ClockKind {
    fn from(clock: ClockArg) -> Self {
        match clock {
            ClockArg::Real => Self::Real,
            ClockArg::Virtual => Self::Virtual,
        }
    }
}

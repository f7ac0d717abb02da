//! The command line: what can be asked for, and what is said to nonsense.

use std::{path::PathBuf, str::FromStr, time::Duration};

use clap::{Args, Parser, Subcommand, ValueEnum, error::ErrorKind};
use ratelab::{
    policy::Brain,
    runtime::{ClockKind, Depth, Hz, Speed, Time},
};

use crate::{error::Error, sweep::SweepArgs};

/// See why robot software is a graph of nodes at fixed rates: a MuJoCo
/// cart-pole, balanced by three nodes that only talk through topics.
#[derive(Debug, Parser)]
#[command(
    name = "ratelab",
    version,
    max_term_width = 100,
    args_conflicts_with_subcommands = true
)]
pub struct Cli {
    /// What to do; the lab, if nothing is said.
    #[command(subcommand)]
    pub command: Option<Command>,

    /// Options of the lab.
    #[command(flatten)]
    pub lab: LabArgs,
}

/// What ratelab can do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Open the dashboard over a running graph (the same as no command).
    Lab(LabArgs),
    /// Run the graph without a dashboard and print what it came to.
    Run(RunArgs),
    /// Run rates, depths and seeds on all cores: how often does the pole stay up?
    Sweep(SweepArgs),
    /// Open a recording in the rerun viewer, or play it in the terminal.
    Replay(ReplayArgs),
    /// Print what is in a recording.
    Info {
        /// The recording.
        #[arg(value_name = "FILE")]
        file: PathBuf,
    },
    /// Run recordings of the virtual clock again and compare every bit.
    Verify {
        /// The recordings.
        #[arg(value_name = "FILE", required = true)]
        files: Vec<PathBuf>,
    },
    /// Learn by predicting: list the exercises, do one, check what they promise.
    Exercise(ExerciseArgs),
    /// Print the keys of the lab.
    Keys,
}

/// What the lab can be asked for: all that a run can, and how it is shown.
#[derive(Debug, Args)]
pub struct LabArgs {
    /// The runs.
    #[command(flatten)]
    pub run: RunArgs,

    /// How it is drawn.
    #[command(flatten)]
    pub screen: ScreenArgs,
}

/// How a dashboard is drawn.
#[derive(Debug, Args)]
pub struct ScreenArgs {
    /// Frames per second at the most (1 to 120).
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..=120), allow_hyphen_values = true)]
    pub fps: u32,

    /// Draw with ASCII characters only.
    #[arg(long)]
    pub ascii: bool,
}

/// Which exercise, and what is predicted.
#[derive(Debug, Args)]
pub struct ExerciseArgs {
    /// The number of an exercise, or check; without it they are listed.
    #[arg(value_name = "N | check")]
    pub what: Option<Wanted>,

    /// The one exercise to check.
    #[arg(value_name = "N", hide = true)]
    pub number: Option<u32>,

    /// Your prediction, such as "8 because …", where nobody can type it.
    #[arg(long, value_name = "TEXT", allow_hyphen_values = true)]
    pub predict: Option<String>,

    /// Predict anew what you predicted before.
    #[arg(long)]
    pub redo: bool,

    /// Judge this recording of a rescue by hand (exercise 5).
    #[arg(long, value_name = "FILE", conflicts_with_all = ["predict", "redo"])]
    pub session: Option<PathBuf>,

    /// Keep predictions in this file [default: exercises/answers.toml]
    #[arg(long, value_name = "FILE")]
    pub answers: Option<PathBuf>,
}

/// What is wanted of the exercises.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// To do one.
    Exercise(u32),
    /// To have what they promise checked.
    Check,
}

impl FromStr for Wanted {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "check" {
            return Ok(Self::Check);
        }
        let number = text.parse().map(Self::Exercise);
        number.map_err(|_| "expected the number of an exercise, or check".to_owned())
    }
}

/// How a recording is shown.
#[derive(Debug, Args)]
pub struct ReplayArgs {
    /// The recording.
    #[arg(value_name = "FILE")]
    pub file: PathBuf,

    /// Play it in the terminal, in the panes of the lab.
    #[arg(long)]
    pub terminal: bool,

    /// How it is drawn in the terminal.
    #[command(flatten)]
    pub screen: ScreenArgs,
}

/// What a run can be asked for. In the lab, what is written is of the last run.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// The graph.
    #[command(flatten)]
    pub graph: GraphArgs,

    /// A short check: 2 seconds on the virtual clock.
    #[arg(long, conflicts_with = "duration_s")]
    pub smoke: bool,

    /// Write metrics.json into this folder, which is made if need be.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,

    /// Write one row per control step to this file.
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,

    /// Record the run to this file, or to one named after the run in the folder
    /// recordings.
    #[arg(long, value_name = "FILE", num_args = 0..=1)]
    pub record: Option<Option<PathBuf>>,

    /// Print the metrics as JSON and nothing else.
    #[arg(long)]
    pub json: bool,
}

/// What a graph can be asked for. Names with underscores are accepted too.
#[derive(Debug, Args)]
pub struct GraphArgs {
    /// Chooses the start, and the numbers of the random policy.
    #[arg(
        long,
        default_value_t = 0,
        value_name = "N",
        value_parser = seed,
        allow_hyphen_values = true
    )]
    pub seed: u64,

    /// Real: one thread per node against the wall clock. Virtual: one thread,
    /// reproducible to the bit [default: real for run, virtual for the lab]
    #[arg(long, value_enum, value_name = "CLOCK")]
    pub clock: Option<ClockArg>,

    /// Run time in seconds [default: 10 for run, no end for the lab]
    #[arg(long, alias = "duration_s", value_name = "S", value_parser = duration, allow_hyphen_values = true)]
    pub duration_s: Option<Time>,

    /// How often the sensor publishes (0.001 to 10000 Hz).
    #[arg(
        long,
        alias = "sensor_hz",
        value_name = "HZ",
        default_value = "50",
        allow_hyphen_values = true
    )]
    pub sensor_hz: Hz,

    /// How often the policy decides (0.001 to 10000 Hz) [default: 50]
    #[arg(
        long,
        alias = "control_hz",
        value_name = "HZ",
        allow_hyphen_values = true
    )]
    pub control_hz: Option<Hz>,

    /// How many messages /obs and /action keep (1 to 1000000).
    #[arg(
        long,
        alias = "queue_depth",
        value_name = "N",
        default_value = "1",
        allow_hyphen_values = true
    )]
    pub queue_depth: Depth,

    /// The brain: scripted, zero, random, lqr, or a file of weights (.pt,
    /// .safetensors, .onnx).
    #[arg(long, value_name = "POLICY", default_value = "scripted")]
    pub policy: Brain,

    /// Break it: the policy decides only 5 times a second.
    #[arg(long = "break", conflicts_with = "control_hz")]
    pub break_bug: bool,

    /// Turn knobs on the way: a file with lines such as "2.5 control-hz 10"
    /// (control-hz, sensor-hz, queue-depth, policy).
    #[arg(long, value_name = "FILE")]
    pub knobs: Option<PathBuf>,

    /// How fast virtual time passes: max, or 0.1 to 100 times wall time
    /// [default: max for run, 1 for the lab]
    #[arg(long, value_name = "FACTOR", value_parser = speed, allow_hyphen_values = true)]
    pub speed: Option<Speed>,

    /// Let the policy think longer: milliseconds of wall time per decision
    /// (real clock only).
    #[arg(long, alias = "think_ms", value_name = "MS", value_parser = think, allow_hyphen_values = true)]
    pub think_ms: Option<Duration>,

    /// Ask for real-time scheduling and locked memory (real clock only).
    #[arg(long)]
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

/// Longest run accepted: a year.
const LONGEST_S: f64 = 365.0 * 24.0 * 3600.0;

fn seed(text: &str) -> Result<u64, String> {
    let expected = || format!("expected a whole number from 0 to {}", u64::MAX);
    text.trim().parse().map_err(|_| expected())
}

/// A run time in seconds.
pub fn duration(text: &str) -> Result<Time, String> {
    number(text, "seconds", 1e-3, LONGEST_S)
        .and_then(|seconds| Time::from_secs_f64(seconds).map_err(|error| error.to_string()))
}

fn think(text: &str) -> Result<Duration, String> {
    number(text, "milliseconds", 0.0, 60_000.0).map(|ms| Duration::from_secs_f64(ms / 1e3))
}

fn speed(text: &str) -> Result<Speed, String> {
    if text == "max" {
        return Ok(Speed::FlatOut);
    }
    let expected = "expected max, or 0.1 to 100 times wall time";
    let factor = text.parse().map_err(|_| expected.to_owned())?;
    Speed::times(factor).map_err(|_| expected.to_owned())
}

fn number(text: &str, unit: &str, least: f64, most: f64) -> Result<f64, String> {
    let number = text.trim().parse().ok();
    number
        .filter(|number| (least..=most).contains(number))
        .ok_or_else(|| format!("expected {least} to {most} {unit}"))
}

/// Prints what was asked for, such as help, or makes one line of an error.
pub fn explain(error: &clap::Error) -> Result<(), Error> {
    match error.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => {
            let _ = error.print(); // Nobody is left to tell if it cannot be printed.
            Ok(())
        }
        _ => Err(Error::BadInput(one_line(&error.to_string()))),
    }
}

/// Joins what clap says over several lines, but for its hints at the usage.
fn one_line(message: &str) -> String {
    let lines = message.lines().map(str::trim);
    let said = lines
        .take_while(|line| !line.starts_with("Usage:") && !line.starts_with("For more information"))
        .filter(|line| !line.is_empty());
    let joined = said.collect::<Vec<_>>().join(" ");
    joined.strip_prefix("error: ").unwrap_or(&joined).to_owned()
}

//! Arguments about the graph and its time.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use ratelab::{ClockKind, Knob, KnobKind, Speed, Time, alternatives};

use super::{
    heading,
    system::{Setting, SystemArgs},
    values,
};

/// The arguments of a graph. Names with underscores are accepted too.
#[derive(Debug, Args)]
#[command(next_help_heading = heading::GRAPH)]
pub struct GraphArgs {
    /// Options of the system.
    #[command(flatten)]
    pub system: SystemArgs<Setting>,

    /// Seed of the start and of all random numbers [default: 0]
    #[arg(long, value_name = "N", value_parser = values::seed, allow_hyphen_values = true)]
    pub seed: Option<u64>,

    /// Turn a knob before the run begins.
    #[arg(long, value_name = "KNOB", help = knob_help())]
    pub knob: Vec<String>,

    /// Turn knobs during the run: a file with lines such as "2.5 rate NODE 10"; the
    /// names of options are knobs, too.
    #[arg(long, value_name = "FILE")]
    pub knobs: Option<PathBuf>,

    /// real: one thread per node, against the wall clock. virtual: one thread, the
    /// same to the bit every time [default: real for run, virtual for the lab]
    #[arg(long, value_enum, value_name = "CLOCK", hide_possible_values = true, help_heading = heading::TIME)]
    pub clock: Option<ClockArg>,

    /// Run time in seconds [default: 10, for the lab no end]
    #[arg(long, alias = "duration_s", value_name = "S", value_parser = values::duration, allow_hyphen_values = true, help_heading = heading::TIME)]
    pub duration_s: Option<Time>,

    /// How fast virtual time passes: max, or 0.1 to 100 times wall time
    /// [default: max, for the lab 1]
    #[arg(long, value_name = "FACTOR", value_parser = values::speed, allow_hyphen_values = true, help_heading = heading::TIME)]
    pub speed: Option<Speed>,

    /// Run in virtual time what was recorded on the real clock: with its rates, depths
    /// and knobs, costs and lateness as they were measured. Other options change that.
    #[arg(long, value_name = "FILE", help_heading = heading::TIME)]
    pub like: Option<PathBuf>,

    /// The world and the machine.
    #[command(flatten)]
    pub timing: TimingArgs,

    /// Ask for real-time scheduling and locked memory (real clock only).
    #[arg(long, help_heading = heading::TIME)]
    pub realtime: bool,
}

/// Returns the help of a knob before the run: every kind of it.
fn knob_help() -> String {
    let usages = KnobKind::ALL.map(|kind| format!("\"{}\"", kind.usage()));
    let usages = alternatives(&usages);
    format!("Turn a knob before the run begins: {usages}; can be given several times")
}

/// A clock by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ClockArg {
    /// One thread per node against the wall clock.
    Real,
    /// One thread, bit-for-bit reproducible.
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

/// The world and the duration of ticks.
#[derive(Debug, Args)]
#[command(next_help_heading = heading::TIME)]
pub struct TimingArgs {
    /// course: the plant waits for the actuator. own: it moves by itself
    /// [default: course]
    #[arg(long, value_enum, value_name = "WORLD", hide_possible_values = true)]
    pub world: Option<WorldArg>,

    /// Step of physics in milliseconds: 1, 2, 5 or 10 (own world only) [default: 1]
    #[arg(
        long,
        alias = "world_step_ms",
        value_name = "MS",
        value_parser = values::step_ms,
        allow_hyphen_values = true
    )]
    pub world_step_ms: Option<u64>,

    /// Duration of the ticks of a node in milliseconds: 30, 60..110, lognormal:MEDIAN,P99,
    /// recorded:FILE, file:CSV (in order) or drawn:CSV (at random); can be given several times.
    #[arg(long, value_name = "NODE=SPEC", value_parser = values::takes)]
    pub takes: Vec<Knob>,

    /// Shift the due times of a node by this many milliseconds; can be given several
    /// times.
    #[arg(long, value_name = "NODE=MS", value_parser = values::offset)]
    pub offset: Vec<Knob>,
}

/// A world by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum WorldArg {
    /// The plant waits for the actuator.
    Course,
    /// The plant moves by itself.
    Own,
}

//! The arguments for the world and for the timing of the target machine.

use clap::{Args, ValueEnum};
use ratelab::Knob;

use super::{heading, values};

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

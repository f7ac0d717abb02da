//! Arguments about the graph and its time, and of a run: on the screen, in a picture and without
//! either.

use std::{path::PathBuf, time::Duration};

use clap::{
    Args, ValueEnum,
    builder::{PathBufValueParser, TypedValueParser},
};
use ratatui::layout::Size;
use ratelab::{ClockKind, Knob, KnobKind, Speed, Time, alternatives};
use ratelab_recording::VIEWER;
use ratelab_screen::Look;

use super::{
    graph_file, heading,
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

/// The arguments of a run. In the lab, files contain the last run.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// The graph.
    #[command(flatten)]
    pub graph: GraphArgs,

    /// A short check: 2 seconds on the virtual clock.
    #[arg(long, conflicts_with_all = ["duration_s", "like"], help_heading = heading::TIME)]
    pub smoke: bool,

    /// Write metrics.json into this folder, which is created if needed.
    #[arg(long, value_name = "DIR", help_heading = heading::OUTPUT)]
    pub out: Option<PathBuf>,

    /// Write one row per control step to this file.
    #[arg(long, value_name = "FILE", help_heading = heading::OUTPUT)]
    pub csv: Option<PathBuf>,

    /// Record the run to this file, which must be new; without a name, to one named
    /// after the run, in ./recordings.
    #[arg(long, value_name = "FILE", num_args = 0..=1, help_heading = heading::OUTPUT)]
    pub record: Option<Option<PathBuf>>,

    /// Record, and send the same to a running rerun viewer, at this address or the usual
    /// one.
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, default_missing_value = VIEWER, help_heading = heading::OUTPUT)]
    pub rerun: Option<String>,

    /// Print the metrics as JSON and nothing else.
    #[arg(long, help_heading = heading::OUTPUT)]
    pub json: bool,
}

/// The arguments of a run without a dashboard.
#[derive(Debug, Args)]
pub struct PlainRunArgs {
    /// The run.
    #[command(flatten)]
    pub run: RunArgs,

    /// Run it again with this many settings of the nodes' phases, drawn by the seed, and print how
    /// the age differs.
    #[arg(long, value_name = "N", value_parser = values::phases, allow_hyphen_values = true, help_heading = heading::TIME)]
    pub phases: Option<usize>,
}

/// The arguments of the lab: of a run and of the display.
#[derive(Debug, Args)]
pub struct LabArgs {
    /// The runs.
    #[command(flatten)]
    pub run: RunArgs,

    /// Options of the display.
    #[command(flatten)]
    pub screen: ScreenArgs,

    /// Show the run of other processes, which listen at this address, such as
    /// tcp/127.0.0.1:7447.
    #[arg(long, value_name = "ADDRESS", help_heading = heading::NETWORK, conflicts_with_all = NO_RUN)]
    pub attach: Option<String>,

    /// A zenoh configuration (JSON5) for --attach, with credentials.
    #[arg(long, value_name = "FILE", help_heading = heading::NETWORK, requires = "attach")]
    pub zenoh_config: Option<PathBuf>,

    /// Longest wait for a connection of --attach, in seconds [default: no limit]
    #[arg(long, value_name = "S", value_parser = values::wait, allow_hyphen_values = true, help_heading = heading::NETWORK, requires = "attach")]
    pub wait_s: Option<Duration>,
}

/// The options of a run of one's own.
const NO_RUN: [&str; 11] = [
    "seed",
    "knob",
    "knobs",
    "clock",
    "duration_s",
    "speed",
    "like",
    "realtime",
    "smoke",
    "csv",
    "takes",
];

/// The options of a dashboard.
#[derive(Debug, Args)]
#[command(next_help_heading = heading::SCREEN)]
pub struct ScreenArgs {
    /// Maximum frames per second (1 to 120).
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = values::fps, allow_hyphen_values = true)]
    pub fps: u32,

    /// Colours for a dark background, a light one, or of high contrast [default: by the
    /// terminal's background, or dark]
    #[arg(long, value_enum, value_name = "THEME")]
    pub theme: Option<Look>,

    /// Draw with ASCII characters only.
    #[arg(long)]
    pub ascii: bool,

    /// Show the limits of the push age, which the course hides until a learner has
    /// predicted them.
    #[arg(long)]
    pub limits: bool,
}

/// What is drawn, and how.
#[derive(Debug, Args)]
pub struct PictureArgs {
    /// The recording; without one, a run of the virtual clock with the options of the
    /// graph.
    #[arg(value_name = "FILE", value_parser = PathBufValueParser::new().try_map(graph_file::recording))]
    pub file: Option<PathBuf>,

    /// Run time (s) [default: the end of the recording, or 10]
    #[arg(long, value_name = "S", value_parser = values::duration, allow_hyphen_values = true, help_heading = heading::SCREEN)]
    pub at: Option<Time>,

    /// Draw the recording up to that moment as a moving picture, at this speed of its run
    /// time, such as 0.2.
    #[arg(long, value_name = "SPEED", num_args = 0..=1, default_missing_value = "1", requires = "file", value_parser = values::pace, allow_hyphen_values = true, help_heading = heading::SCREEN)]
    pub animate: Option<f64>,

    /// Colours for a dark background, a light one, or of high contrast.
    #[arg(long, value_enum, value_name = "THEME", default_value_t, help_heading = heading::SCREEN)]
    pub theme: Look,

    /// Columns and rows, 40x12 to 400x200.
    #[arg(long, value_name = "WxH", default_value = "120x35", value_parser = values::size, help_heading = heading::SCREEN)]
    pub size: Size,

    /// Draw with ASCII characters only.
    #[arg(long, help_heading = heading::SCREEN)]
    pub ascii: bool,

    /// Show the limits of the push age, which the course hides until a learner has
    /// predicted them.
    #[arg(long, help_heading = heading::SCREEN)]
    pub limits: bool,

    /// The picture to write.
    #[arg(short, long, value_name = "FILE", default_value = "lab.svg")]
    pub output: PathBuf,

    /// The graph.
    #[command(flatten)]
    pub graph: GraphArgs,
}

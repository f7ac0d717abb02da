//! The command line.

mod course;
mod examples;
mod graph_file;
mod network;
mod recordings;
mod run;
mod sweep;
mod system;
mod values;

use std::{ffi::OsString, path::PathBuf};

use clap::{Arg, ArgMatches, Args, FromArgMatches, Subcommand, ValueHint, error::ErrorKind};
use clap_complete::Shell;
use ratelab_system::plant_topic;

use crate::program::{self, Program};
use ratelab_recording::printable::in_line;

#[cfg(feature = "network")]
pub use self::network::{NetworkArgs, ProcessArgs, RosArgs};
pub use self::{
    course::{ExerciseArgs, GradeArgs, Label, Wanted},
    examples::EXAMPLES,
    graph_file::{NewArgs, is_graph_file, take as take_graph_file},
    network::{NodeArgs, UpArgs},
    recordings::{
        BranchArgs, ExportArgs, ExportWebArgs, InfoArgs, ReplayArgs, TableArgs, TraceArgs,
        VerifyArgs,
    },
    run::{
        ClockArg, GraphArgs, LabArgs, PictureArgs, PlainRunArgs, RunArgs, ScreenArgs, TimingArgs,
        WorldArg,
    },
    sweep::{ByArg, SweepArgs},
    system::DEFAULT_RATES,
};
pub use recordings::{LookArgs, with_look};
pub use sweep::{AdviseArgs, CheckArgs, HuntArgs, MarginsArgs};

/// Headings of the groups of options.
pub mod heading {
    /// Options of the graph.
    pub const GRAPH: &str = "Graph";
    /// Options of clocks and durations.
    pub const TIME: &str = "Time";
    /// Options of files and printed output.
    pub const OUTPUT: &str = "Output";
    /// Options of connections.
    pub const NETWORK: &str = "Network";
    /// Options of the display.
    pub const SCREEN: &str = "Screen";
}

/// The commands of ratelab.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Open the dashboard over a running graph (the same as no command).
    Lab(LabArgs),
    /// Run the graph without a dashboard and print a summary.
    Run(PlainRunArgs),
    /// Run many rates, depths and seeds on all cores; count the successful runs.
    Sweep(SweepArgs),
    /// Try changes that could make the data younger, and rank them by their effect.
    Advise(AdviseArgs),
    /// Find the smallest set of faults that makes a run fail.
    Hunt(HuntArgs),
    /// Measure how old, rare and unsure the data of a robot may be, with theory beside it.
    Margins(MarginsArgs),
    /// Compare a graph with the limits in its file, for tests: exit code 1 if one is missed.
    Check(CheckArgs),
    /// Write an example of a graph file, or a program that runs a policy of a library.
    New(NewArgs),
    /// Print what the times in a bag of ROS 2 say: rates, gaps, clocks, nodes, ages of data.
    Look(LookArgs),
    /// Open a recording in the rerun viewer, or play it in the terminal.
    Replay(ReplayArgs),
    /// Print the content of a recording.
    Info(InfoArgs),
    /// Run recordings again and compare every bit.
    Verify(VerifyArgs),
    /// Leave a recorded run at a moment with something changed, and compare the results.
    Branch(BranchArgs),
    /// Write a recording as tables: one for each topic and node, for pandas and spreadsheets.
    Table(TableArgs),
    /// Write a recording as a trace for Perfetto: what each tick and message did.
    Trace(TraceArgs),
    /// Write a recording as MCAP, for other tools: messages, ages, drops, overruns.
    Export(ExportArgs),
    /// Write recordings as one page for the browser, which plays them.
    ExportWeb(ExportWebArgs),
    /// Draw the dashboard at a moment of a recording, or of a run, as an SVG file.
    Picture(PictureArgs),
    /// Run the graph in several processes of this machine, with the dashboard over all.
    Up(UpArgs),
    /// Run some nodes of the graph here; the others run in other processes.
    Node(NodeArgs),
    /// The commands of the course.
    #[command(skip)]
    Course(CourseCommand),
    /// Print the keys of the lab.
    Keys,
    /// Print a completion script for a shell.
    Completions {
        /// The shell.
        #[arg(value_name = "SHELL")]
        shell: Shell,
    },
    /// Print the manual page, or write one page per command.
    Man {
        /// Write the pages into this folder, which is created if needed.
        #[arg(value_name = "DIR")]
        folder: Option<PathBuf>,
    },
}

/// The commands that only a course has.
#[derive(Debug, Subcommand)]
pub enum CourseCommand {
    /// Learn by predicting: list the exercises, do one, check what they promise.
    Exercise(ExerciseArgs),
    /// Grade the hand-ins of many learners in one table.
    Grade(GradeArgs),
    /// Open the lab with a guide: five minutes, step by step.
    Tour(ScreenArgs),
}

/// Place of the commands of the course in the help: the others have even places.
const COURSE: usize = 37;

/// Parses the command line `args` of `program`.
///
/// # Errors
/// An error, or a request for output such as help; see [`explain`].
pub fn parse(program: &Program, args: Vec<OsString>) -> Result<Command, clap::Error> {
    let mut command = command(program);
    let parsed = command.try_get_matches_from_mut(&args);
    // clap leaves control characters out of its errors: a value of nothing else would be empty.
    let shown = args.iter().map(|arg| in_line(&arg.to_string_lossy()));
    let matches = parsed.map_err(|error| {
        let again = command.try_get_matches_from_mut(shown);
        again.err().unwrap_or(error)
    })?;
    refuse_dash(&command, &matches)?;
    match matches.subcommand() {
        None => LabArgs::from_arg_matches(&matches).map(Command::Lab),
        Some((name, _)) if CourseCommand::has_subcommand(name) => {
            CourseCommand::from_arg_matches(&matches).map(Command::Course)
        }
        Some(_) => Command::from_arg_matches(&matches),
    }
}

/// Refuses `-` in the place of a file: it would be a file of this name, and others mean a stream.
fn refuse_dash(command: &clap::Command, matches: &ArgMatches) -> Result<(), clap::Error> {
    if let Some((name, matches)) = matches.subcommand()
        && let Some(command) = command.find_subcommand(name)
    {
        return refuse_dash(command, matches);
    }
    let mut files = command.get_arguments().filter(|arg| is_of_a_file(arg));
    let is_dash = |arg: &&Arg| {
        let given = matches.try_get_raw(arg.get_id().as_str()).ok().flatten();
        given.is_some_and(|mut given| given.any(|value| value == "-"))
    };
    let Some(arg) = files.find(is_dash) else {
        return Ok(());
    };
    let why = "- is not the name of a file here: /dev/stdout is the standard output, ./- a file of \
               this name";
    // Only a built command knows how to print an argument.
    let name = arg
        .get_long()
        .map_or_else(|| arg.get_id().to_string(), |long| format!("--{long}"));
    let text = format!("{name}: {why}");
    Err(command.clone().error(ErrorKind::InvalidValue, text))
}

/// Returns whether the value of `arg` is the path of a file or folder.
fn is_of_a_file(arg: &Arg) -> bool {
    use ValueHint::{AnyPath, DirPath, FilePath};
    matches!(arg.get_value_hint(), AnyPath | DirPath | FilePath)
}

/// Returns the definition of the command line of `program`.
pub fn command(program: &Program) -> clap::Command {
    let about = if program.course {
        "See why robot software is a graph of nodes at fixed rates: a MuJoCo cart-pole, balanced \
         by three nodes that only talk through topics"
            .to_owned()
    } else {
        format!("{}: a graph of nodes at fixed rates", program.system.name())
    };
    let mut command = Command::augment_subcommands(LabArgs::augment_args(
        clap::Command::new(program::name())
            .args_conflicts_with_subcommands(true)
            .max_term_width(100),
    ));
    if program.course {
        command = CourseCommand::augment_subcommands(command);
    }
    let name = program::name();
    let described = command
        .override_usage(format!(
            "{name} [GRAPH.toml] [OPTIONS]\n       {name} <COMMAND>"
        ))
        .about(about)
        .version(program::short(program))
        .long_version(program::long(program));
    let with_options = |command: clap::Command| match command.get_name() {
        "lab" | "run" | "advise" | "hunt" | "check" | "picture" | "up" | "node" => {
            network::describe(system::with_run_options(command, program), program)
        }
        "sweep" => system::with_axes(command, program),
        _ => command,
    };
    let command = without_effectless(system::with_run_options(described, program), program);
    let mut places = (1..).map(|place| 2 * place);
    examples::add(command.mut_subcommands(|command| {
        let place = match command.get_name() {
            name if CourseCommand::has_subcommand(name) => Some(COURSE),
            _ => places.next(),
        };
        let command = graph_file::describe(with_options(command));
        let command = without_effectless(command, program);
        examples::add(command).display_order(place)
    }))
}

/// Hides the options that `command` refuses, or that have no effect for the system of `program`:
/// clocks where all runs are virtual, the world's options without a plant, and `--limits` outside
/// of the course, which hides limits.
fn without_effectless(command: clap::Command, program: &Program) -> clap::Command {
    let of_world = ["world", "world_step_ms"];
    let of_clocks = ["clock", "realtime", "speed"];
    let has_plant = plant_topic(&*program.system).is_some();
    let is_virtual = ["advise", "check", "hunt", "margins"].contains(&command.get_name());
    command.mut_args(|arg| {
        let id = arg.get_id().as_str();
        let is_idle = !has_plant && of_world.contains(&id)
            || is_virtual && of_clocks.contains(&id)
            || !program.course && id == "limits";
        if is_idle { arg.hide(true) } else { arg }
    })
}

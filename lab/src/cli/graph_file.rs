//! The graph file on the command line: the first argument, or the one behind the name of a
//! command; of `node` also one behind names of nodes. It is taken out before the rest is parsed,
//! because it decides on the options.

use std::{
    ffi::{OsStr, OsString},
    path::{Path, PathBuf},
};

use super::heading;
use crate::program;
use clap::{
    Arg, Args, Command, ValueHint,
    builder::{PossibleValuesParser, TypedValueParser},
};
use ratelab_cart_pole::policy::ProgramKind;
use thiserror::Error;

/// The ending of graph files.
const ENDING: &str = "toml";

/// The commands that run a graph.
const COMMANDS: [&str; 10] = [
    "lab", "run", "sweep", "advise", "hunt", "margins", "check", "picture", "up", NODE,
];

/// The command whose other arguments are names.
const NODE: &str = "node";

/// Name of the option that changes the file.
const WITH: &str = "with";

/// Returns the graph file in `args` if any, its changes, and the other arguments.
pub fn take(
    args: impl IntoIterator<Item = OsString>,
) -> (Option<PathBuf>, Vec<String>, Vec<OsString>) {
    let mut args: Vec<OsString> = args.into_iter().collect();
    let is_command = |arg: &OsString| COMMANDS.iter().any(|command| arg == OsStr::new(command));
    let command = args.get(1).filter(|arg| is_command(arg));
    let first = if command.is_some() { 2 } else { 1 };
    let is_word = |arg: &&OsString| !arg.to_string_lossy().starts_with('-');
    let words = args.iter().skip(first).take_while(is_word).count();
    let takes_names = command.is_some_and(|command| command == NODE);
    let words = if takes_names { words } else { words.min(1) };
    let mut places = first..first + words;
    let Some(place) = places.find(|place| is_graph_file(&args[*place])) else {
        return (None, Vec::new(), args);
    };
    let file = Some(args.remove(place).into());
    let (mut with, mut others) = (Vec::new(), Vec::new());
    let mut words = args.into_iter();
    while let Some(arg) = words.next() {
        let text = arg.to_string_lossy();
        match text.strip_prefix("--with") {
            Some("") => with.extend(words.next()),
            Some(change) if change.starts_with('=') => with.push(change[1..].into()),
            _ => others.push(arg),
        }
    }
    (
        file,
        with.iter()
            .map(|with| with.to_string_lossy().into_owned())
            .collect(),
        others,
    )
}

/// Returns whether `arg` names a graph file.
pub fn is_graph_file(arg: &OsStr) -> bool {
    Path::new(arg).extension() == Some(OsStr::new(ENDING))
        && !arg.to_string_lossy().starts_with('-')
}

/// Adds the graph file to the help of `command`, if it runs a graph.
pub fn describe(command: Command) -> Command {
    // The other argument of a picture is a recording.
    let name = command.get_name().to_owned();
    if name == "picture" || !COMMANDS.contains(&&*name) {
        return command;
    }
    let with = Arg::new(WITH)
        .long(WITH)
        .value_name("KEY=VALUE")
        .help("Change a key of the graph file, such as 'node.planner.trigger = [\"/objects\"]'")
        .help_heading(heading::GRAPH)
        .value_parser(without_file);
    if name == NODE {
        let usage = format!("{} node [GRAPH.toml] [OPTIONS] <NODE>...", program::name());
        return command.override_usage(usage).arg(with);
    }
    let graph = Arg::new("graph_file")
        .value_name("GRAPH")
        .help("A graph file (.toml) in place of the built-in graph; see ratelab new")
        .value_hint(ValueHint::FilePath)
        .value_parser(misplaced);
    // Not the usage that clap makes: the file stands first.
    let usage = format!("{} {name} [GRAPH.toml] [OPTIONS]", program::name());
    command.override_usage(usage).arg(graph).arg(with)
}

/// A graph file that is missing, or is at another place than it should be.
#[derive(Debug, Error)]
pub enum GraphFilePlace {
    /// A change without a graph file.
    #[error("there is no graph file to change: it stands right behind the command")]
    Missing,
    /// Another file.
    #[error("expected a graph file, which ends in .{ENDING}")]
    Other,
    /// A graph file behind other arguments.
    #[error("{MISPLACED}")]
    Misplaced,
    /// A graph file among the names of nodes.
    #[error("{MISPLACED}, as in {} node {file} NODE", program::name())]
    AmongNodes {
        /// The file.
        file: String,
    },
}

const MISPLACED: &str = "the graph file stands first, or right behind the command";

/// Refuses a change without a graph file.
fn without_file(_: &str) -> Result<String, GraphFilePlace> {
    Err(GraphFilePlace::Missing)
}

/// Refuses a graph file at another place.
fn misplaced(text: &str) -> Result<PathBuf, GraphFilePlace> {
    Err(if is_graph_file(OsStr::new(text)) {
        GraphFilePlace::Misplaced
    } else {
        GraphFilePlace::Other
    })
}

/// Returns the path of a recording, which is not that of a graph file.
///
/// # Errors
/// The place of the graph file.
pub fn recording(path: PathBuf) -> Result<PathBuf, GraphFilePlace> {
    if is_graph_file(path.as_os_str()) {
        return Err(GraphFilePlace::Misplaced);
    }
    Ok(path)
}

/// Returns the name of a node, which is not a graph file.
///
/// # Errors
/// The place of the graph file.
pub fn node_name(text: &str) -> Result<String, GraphFilePlace> {
    let text = text.to_owned();
    if is_graph_file(OsStr::new(&text)) {
        return Err(GraphFilePlace::AmongNodes { file: text });
    }
    Ok(text)
}

/// The file to write, or the schema.
#[derive(Debug, Args)]
pub struct NewArgs {
    /// The graph file, which must be new and end in .toml; with --policy the program, which
    /// ends in .py.
    #[arg(value_name = "FILE", required_unless_present = "schema")]
    pub file: Option<PathBuf>,

    /// Write the graph that made this bag (as of ratelab look): rates, costs, phases, losses, chains,
    /// each with its evidence as a comment. Costs go into files in FILE.data beside it.
    #[arg(long, value_name = "BAG", requires = "file", conflicts_with = "policy")]
    pub from: Option<PathBuf>,

    /// A topic that a node makes of another one with a new header stamp, such as "/plan > /cmd":
    /// no bag tells that. May be repeated.
    #[arg(long, value_name = "EDGE", requires = "from")]
    pub edge: Vec<String>,

    /// Write a program that runs a policy of a library: sb3 (Stable-Baselines3), torchscript,
    /// onnx, or module (a network of PyTorch and its state_dict).
    #[arg(long, value_name = "KIND", value_parser = program_kind(), requires = "file", hide_possible_values = true)]
    pub policy: Option<ProgramKind>,

    /// Print the JSON Schema of graph files, with which editors complete them.
    #[arg(long, conflicts_with_all = ["file", "from", "policy"])]
    pub schema: bool,
}

/// Returns the kinds of programs for policies.
fn program_kind() -> impl TypedValueParser<Value = ProgramKind> {
    PossibleValuesParser::new(ProgramKind::NAMES).try_map(|kind| kind.parse::<ProgramKind>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_graph_file_is_the_first_argument_or_that_behind_a_command_that_runs_a_graph() {
        let words = |line: &str| -> Vec<OsString> {
            let line = format!("ratelab {line}");
            line.split_whitespace().map(OsString::from).collect()
        };
        // Without a file all words stay.
        for (line, without_file) in [
            ("g.toml", Some("")),
            ("run g.toml --json", Some("run --json")),
            ("g.toml run --json", Some("run --json")),
            ("node g.toml a", Some("node a")),
            ("node a b g.toml --insecure", Some("node a b --insecure")),
            ("g.toml node a", Some("node a")),
            ("node a --record g.toml", None),
            ("node", None),
            ("run --out g.toml", None),
            ("run x g.toml", None),
            ("grade g.toml", None),
            ("new g.toml", None),
            ("--x.toml", None),
            ("", None),
        ] {
            let (found, _, rest) = take(words(line));
            let file = without_file.map(|_| PathBuf::from("g.toml"));
            let expected = (file, words(without_file.unwrap_or(line)));
            assert_eq!((found, rest), expected, "{line:?}");
        }
    }
}

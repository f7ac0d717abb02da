//! The command lines that start the parts of a run.

use std::{collections::HashMap, env};

use clap::{Args, Command};
use ratelab_network::{StartCommands, USUAL};

use crate::{
    cli::{NodeArgs, UpArgs, take_graph_file},
    program::{self, command_line},
};

/// Returns the command line of this process.
pub fn this_one() -> String {
    command_line(with_name(given()))
}

/// Returns the command line of `up`, of which this process is the child for the first part.
pub fn up_line() -> String {
    let hidden = HashMap::from([("part".to_owned(), 2)]);
    command_line(with_name(without(given(), &hidden)))
}

/// Returns the command line of a process for one `part` of `up`, of which this process is the
/// child: that of `up`, without what `node` does not know.
pub fn part_line(part: &str, address: &str) -> String {
    command_line(with_name(part_of(given(), part, address)))
}

/// Returns the words of the command line of this process, without its name.
fn given() -> Vec<String> {
    env::args_os()
        .skip(1)
        .map(|word| word.to_string_lossy().into_owned())
        .collect()
}

fn with_name(words: Vec<String>) -> impl Iterator<Item = String> {
    [program::name()].into_iter().chain(words)
}

/// Returns the words of `up` as those of `node`.
fn part_of(words: Vec<String>, part: &str, address: &str) -> Vec<String> {
    let of_node = longs(NodeArgs::augment_args(Command::new("node")));
    let mut strange = longs(UpArgs::augment_args(Command::new("up")));
    // ROS sees the first part alone.
    strange.retain(|name, _| !of_node.contains_key(name) || name == "ros" || name == "domain");
    let mut words = without(words, &strange);
    if let Some(up) = words.iter_mut().find(|word| *word == "up") {
        "node".clone_into(up);
    }
    let names = words.iter().take_while(|word| !word.starts_with('-'));
    words.insert(names.count(), part.to_owned());
    words.extend(connect(address));
    words
}

/// Returns the options of `command`, with the number of their values.
fn longs(mut command: Command) -> HashMap<String, usize> {
    command.build();
    let arguments = command.get_arguments();
    let longs = arguments.filter_map(|argument| {
        let values = argument
            .get_num_args()
            .map_or(0, |range| range.min_values());
        Some((argument.get_long()?.to_owned(), values))
    });
    longs.collect()
}

/// Returns the `words` without these options and their values.
fn without(words: Vec<String>, options: &HashMap<String, usize>) -> Vec<String> {
    let (mut kept, mut words) = (Vec::new(), words.into_iter());
    while let Some(word) = words.next() {
        let name = word.strip_prefix("--").unwrap_or_default();
        let (name, value) = name
            .split_once('=')
            .map_or((name, None), |(name, value)| (name, Some(value)));
        match (options.get(name), value) {
            (None, _) => kept.push(word),
            (Some(_), Some(_)) => {}
            (Some(values), None) => words.by_ref().take(*values).for_each(drop),
        }
    }
    kept
}

/// Returns the option for the address of the process that listens, unless it is the usual one.
fn connect(address: &str) -> Vec<String> {
    if address == USUAL {
        return Vec::new();
    }
    vec!["--connect".to_owned(), address.to_owned()]
}

/// The command lines that a dashboard names.
pub struct CommandLines {
    /// The graph file, and its changes.
    graph: Vec<String>,
    /// Where the run listens.
    address: String,
    /// The name of the system without a graph file.
    built_in: String,
}

impl CommandLines {
    /// Creates the command lines for the run at `address`.
    pub fn new(address: &str, built_in: &str) -> Self {
        let (file, with, _) = take_graph_file(env::args_os());
        let file = file.map(|file| file.display().to_string());
        let with = with
            .into_iter()
            .flat_map(|change| ["--with".to_owned(), change]);
        Self {
            graph: file.into_iter().chain(with).collect(),
            address: address.to_owned(),
            built_in: built_in.to_owned(),
        }
    }
}

impl StartCommands for CommandLines {
    fn node(&self, node: &str) -> String {
        let mut words = vec!["node".to_owned()];
        words.extend(self.graph.iter().take(1).cloned());
        words.push(node.to_owned());
        words.extend(self.graph.iter().skip(1).cloned());
        words.extend(connect(&self.address));
        command_line(with_name(words))
    }

    /// Returns the system, which is usually in the file of its name unless it is built in.
    fn lab(&self, system: &str) -> String {
        let file = (system != self.built_in).then(|| format!("{system}.toml"));
        let words = ["lab".to_owned()].into_iter().chain(file);
        let words = words.chain(["--attach".to_owned(), self.address.clone()]);
        command_line(with_name(words.collect()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_of_up_is_started_again_by_node_with_the_same_graph() {
        for (up, node) in [
            ("up --part policy A", "node policy --connect A"),
            (
                "up g.toml --rate 5 --port 0 --ascii --part b tcp/127.0.0.1:9",
                "node g.toml b --rate 5 --connect tcp/127.0.0.1:9",
            ),
            (
                "g.toml up --fps=9 --with x=1 --theme light --ros --domain 3 --seed 2 --part b A",
                "g.toml node b --with x=1 --seed 2 --connect A",
            ),
            ("up --seed 2 --part b tcp/127.0.0.1:7447", "node b --seed 2"),
        ] {
            let words =
                |line: &str| -> Vec<String> { line.split(' ').map(str::to_owned).collect() };
            let (given, expected) = (words(up), words(node));
            let part = if up.contains("policy") { "policy" } else { "b" };
            let address = given.last().cloned().unwrap_or_default();
            assert_eq!(part_of(given, part, &address), expected, "{up}");
        }
    }
}

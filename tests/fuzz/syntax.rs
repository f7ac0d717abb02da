//! Command lines, built from the options in the help texts.

use std::{
    ffi::{OsStr, OsString},
    path::Path,
};

use rand::{Rng, seq::IndexedRandom};

use crate::{
    cases::{RandomSource, chance, pick_from},
    program::does,
    values::value,
};

/// Invalid words, separated by `|`.
const RUBBISH: &str = "--|-|--x|-x|--=|--csv|\u{1b}[2J|--\u{1b}|run|";

/// An option, with the name of its value, if it takes one.
type Opt = (String, Option<String>);

/// A command according to its help.
pub struct Syntax {
    /// Empty for ratelab itself.
    command: String,
    options: Vec<Opt>,
    /// Names of the values without an option.
    arguments: Vec<String>,
}

/// All commands with their options, from their help texts.
pub fn syntaxes(folder: &Path) -> Vec<Syntax> {
    let help = help("", folder);
    let commands = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let commands = commands.map_while(|line| line.split_whitespace().next());
    let commands = commands.filter(|command| *command != "help");
    let commands: Vec<_> = [""].into_iter().chain(commands).collect();
    assert!(commands.len() > 5, "help names only {commands:?}");
    let read = |command: &&str| Syntax::read(command, folder);
    commands.iter().map(read).collect()
}

fn help(command: &str, folder: &Path) -> String {
    let output = does(&format!("{command} --help"), folder);
    String::from_utf8(output.stdout).expect("UTF-8")
}

impl Syntax {
    fn read(command: &str, folder: &Path) -> Self {
        let (mut options, mut arguments) = (Vec::new(), Vec::new());
        let help = help(command, folder);
        for line in help.lines().take_while(|line| *line != "Examples:") {
            // Deeper indentation marks the text beside an option.
            let named = line.len() - line.trim_start().len() <= 6;
            let what = line.trim_start().split("  ").next().unwrap_or_default();
            let value = |from: usize| {
                what[from..]
                    .trim_matches(|c| "<>[]. ".contains(c))
                    .to_owned()
            };
            if let Some(option) = what.find("--").filter(|_| named && what.starts_with('-')) {
                let name = what[option..].split(' ').next().unwrap_or_default();
                let takes = what.find('<').map(value);
                options.push((name.to_owned(), takes));
            } else if named && what.starts_with(['<', '[']) {
                arguments.push(value(0));
            }
        }
        let command = command.to_owned();
        Self {
            command,
            options,
            arguments,
        }
    }

    /// A command line, valid or invalid.
    pub fn line(&self, random: &mut RandomSource) -> Vec<OsString> {
        let mut words = Vec::new();
        // Runs and sweeps of ten seconds would take too long.
        let is_time = |(name, _): &&Opt| name == "--duration-s";
        let (time, others): (Vec<_>, Vec<_>) = self.options.iter().partition(is_time);
        let count = random.random_range(0..5);
        let mut chosen: Vec<_> = others.choose_multiple(random, count).collect();
        if chosen.iter().all(|(name, _)| name != "--smoke") {
            chosen.extend(&time);
        }
        for (name, value) in chosen {
            option(name, value.as_deref(), random, &mut words);
        }
        for name in &self.arguments {
            if chance(random, 85) {
                words.push(value(name, random));
            }
        }
        if chance(random, 10) {
            let at = random.random_range(0..=words.len());
            words.insert(at, pick_from(random, RUBBISH).into());
        }
        if !self.command.is_empty() {
            words.insert(0, OsString::from(&self.command));
        }
        words
    }
}

/// Adds an option, mostly with its value.
fn option(name: &str, takes: Option<&str>, random: &mut RandomSource, words: &mut Vec<OsString>) {
    let Some(takes) = takes.filter(|_| chance(random, 97)) else {
        words.push(name.into());
        return;
    };
    let mut values = takes.split("> <").map(|takes| value(takes, random));
    let value = values.next().expect("a value");
    let others: Vec<OsString> = values.collect();
    if chance(random, 20) {
        let joined = [OsStr::new(name), OsStr::new("="), &value];
        words.push(joined.into_iter().collect());
    } else {
        words.extend([name.into(), value]);
    }
    words.extend(others);
}

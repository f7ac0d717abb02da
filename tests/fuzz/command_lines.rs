//! Command lines: whatever is asked for, the answer is orderly, and what is
//! refused leaves nothing behind.

use std::{
    collections::BTreeMap,
    ffi::{OsStr, OsString},
    fs,
    os::unix::{ffi::OsStringExt, fs::symlink},
    path::{Path, PathBuf},
    process::Output,
};

use rand::{Rng, seq::IndexedRandom};
use tempfile::tempdir;

use crate::{
    cases::{Random, chance, pick, run},
    program::ratelab,
    root,
};

/// Names of files and folders, of which some are there: see [`prepare`]. Nothing
/// outside of the folder is named: what is written may replace it.
const FILES: (&[&str], &[&str]) = (
    &["rows.csv", "turns.knobs", "run.rrd", "brain.pt", "new.csv", "new.rrd"],
    &[
        "", ".", "folder", "folder/", "new/rows.csv", "rows.csv/x", "none", "zero", "full", "loop",
        "torn.rrd", "-", "\u{1b}[31mred", "a\nb", "\u{9b}2J", "a b.csv", "#", "é.csv", "../x.csv",
    ],
);

const RATES: (&[&str], &[&str]) = (
    &["50", "5", "7.5", "0.001", "10000", "1e3"],
    &["0.0009999", "10000.1", "0", "-1", "NaN", "inf", "1e400", "", "fast", "5\u{1b}[m"],
);

const COUNTS: (&[&str], &[&str]) = (
    &["1", "2", "30", "100"],
    &["0", "120", "121", "1000000", "1000001", "18446744073709551615", "18446744073709551616", "-1", "1.5", ""],
);

const POLICIES: (&[&str], &[&str]) = (
    &["scripted", "lqr", "zero", "random", "brain.pt", "turns.knobs"],
    &["asks.pt", "none.pt", "rows.csv", "folder", "zero.pt", "LQR", "", "lqr,", "\u{1b}[31mred", "x.onnx"],
);

/// Short ones: a year is accepted too.
const DURATIONS: (&[&str], &[&str]) = (
    &["0.05", "0.001", "0.1", "1e-2"],
    &["0", "0.0009", "31536001", "-1", "NaN", "inf", "1e400", "", "\u{7f}"],
);

const LISTS: (&[&str], &[&str]) = (
    &["5", "5,10", "1..3", "1..2:0.5", "7"],
    &[
        "3..1", "..", "1..", "5,,6", "1..1000000000000", "0..18446744073709551615", "scripted,lqr",
        "brain.pt,zero", "1..3:0", "1..3:-1", "1..3:1e-9", "", ",", "NaN..1", "1..inf", "-1..1", "\u{1b}",
    ],
);

/// Values for what help calls `name`: good ones, and others.
fn values(name: &str) -> (&'static [&'static str], &'static [&'static str]) {
    match name {
        "HZ" => RATES,
        "N" => COUNTS,
        "POLICY" => POLICIES,
        "LIST" => LISTS,
        "FILE" | "DIR" => FILES,
        "S" => DURATIONS,
        "CLOCK" => (&["virtual", "real"], &["", "Virtual", "both", "\u{8}"]),
        // Slower than the wall's or with much to think about, a run takes long.
        "FACTOR" => (&["max", "1", "100"], &["0.09", "101", "MAX", "-1", "NaN", ""]),
        "MS" => (&["0", "1", "5"], &["60000.1", "-1", "NaN", "", "1e400"]),
        "TEXT" => (&["8 because half", "0.5 as"], &["", "8", "-1 x", "many", "1e400 x", "\u{1b}[2J"]),
        "SHELL" => (&["bash", "zsh", "fish"], &["", "tcsh", "\u{1b}"]),
        "N | check" => (&["1", "2", "5"], &["0", "6", "check1", "99999999999", "", "\u{1b}"]),
        _ => panic!("no values are known for what help calls {name}: add some"),
    }
}

/// A command as its help describes it.
struct Syntax {
    /// Nothing for ratelab itself.
    command: String,
    /// Options, each with the name of its value, if it takes one.
    options: Vec<(String, Option<String>)>,
    /// Names of the values without an option.
    arguments: Vec<String>,
}

/// All commands with their options, from the help that they print.
fn syntaxes(folder: &Path) -> Vec<Syntax> {
    let help = help("", folder);
    let commands = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let commands = commands.map_while(|line| line.split_whitespace().next());
    let commands = commands.filter(|command| *command != "help");
    let syntaxes: Vec<_> = [""].into_iter().chain(commands).map(|c| Syntax::read(c, folder)).collect();
    assert!(syntaxes.len() > 5, "help names only {} commands", syntaxes.len());
    syntaxes
}

fn help(command: &str, folder: &Path) -> String {
    let args: Vec<_> = command.split_whitespace().chain(["--help"]).collect();
    let output = ratelab(&args, folder, folder);
    String::from_utf8(output.stdout).expect("UTF-8")
}

impl Syntax {
    fn read(command: &str, folder: &Path) -> Self {
        let (mut options, mut arguments) = (Vec::new(), Vec::new());
        let help = help(command, folder);
        for line in help.lines().take_while(|line| *line != "Examples:") {
            // What is indented further is the text beside it.
            let named = line.len() - line.trim_start().len() <= 6;
            let what = line.trim_start().split("  ").next().unwrap_or_default();
            let value = |from: usize| what[from..].trim_matches(|c| "<>[]. ".contains(c)).to_owned();
            if let Some(option) = what.find("--").filter(|_| named && what.starts_with('-')) {
                let name = what[option..].split(' ').next().unwrap_or_default();
                let takes = what.find('<').map(value);
                options.push((name.to_owned(), takes));
            } else if named && what.starts_with(['<', '[']) {
                arguments.push(value(0));
            }
        }
        let command = command.to_owned();
        Self { command, options, arguments }
    }

    /// A command line, good or bad.
    fn line(&self, random: &mut Random) -> Vec<OsString> {
        let mut words = Vec::new();
        let count = random.random_range(0..5);
        for (name, value) in self.options.choose_multiple(random, count).collect::<Vec<_>>() {
            option(name, value.as_deref(), random, &mut words);
        }
        // Nobody waits for a run of ten seconds, or a sweep of them.
        if let Some((name, value)) = self.options.iter().find(|(name, _)| name == "--duration-s")
            && !words.iter().any(|word| word == "--smoke" || word == "--duration-s")
        {
            option(name, value.as_deref(), random, &mut words);
        }
        for name in &self.arguments {
            if chance(random, 85) {
                words.push(value(name, random));
            }
        }
        if chance(random, 10) {
            let rubbish = ["--", "-", "--rubbish", "-x", "--=", "--csv", "\u{1b}[2J", "--\u{1b}", "run", ""];
            let at = random.random_range(0..=words.len());
            words.insert(at, pick(random, &rubbish).into());
        }
        if !self.command.is_empty() {
            words.insert(0, OsString::from(&self.command));
        }
        words
    }
}

/// Adds an option, mostly with its value.
fn option(name: &str, takes: Option<&str>, random: &mut Random, words: &mut Vec<OsString>) {
    let Some(takes) = takes.filter(|_| chance(random, 97)) else {
        words.push(name.into());
        return;
    };
    let value = value(takes, random);
    if chance(random, 20) {
        let joined = [OsStr::new(name), OsStr::new("="), &value];
        words.push(joined.into_iter().collect());
    } else {
        words.extend([name.into(), value]);
    }
}

/// A value for what help calls `name`: good, not so good, or no text at all.
fn value(name: &str, random: &mut Random) -> OsString {
    let (good, others) = values(name);
    match random.random_range(0..100) {
        0..75 => pick(random, good).into(),
        75..98 => pick(random, others).into(),
        98 => OsString::from_vec(vec![b'a', 0xff, 0x1b]),
        _ => "x".repeat(random.next_u32() as usize % 5_000).into(),
    }
}

/// Fills `folder` with what must not be lost, and with traps.
fn prepare(folder: &Path) {
    fs::create_dir(folder.join("folder")).expect("made");
    let copies = [
        ("recordings/fall-5hz.rrd", "run.rrd"),
        ("tests/brains/actor.pt", "brain.pt"),
        ("tests/brains/asks.pt", "asks.pt"),
    ];
    for (from, to) in copies {
        fs::copy(root().join(from), folder.join(to)).expect("copied");
    }
    let torn = &fs::read(folder.join("run.rrd")).expect("read")[..200_000];
    let texts = [("rows.csv", "step,time_s\n1,0.0\n"), ("turns.knobs", "0.01 control-hz 10\n")];
    for (name, text) in texts {
        fs::write(folder.join(name), text).expect("written");
    }
    fs::write(folder.join("torn.rrd"), torn).expect("written");
    for (name, to) in [("zero", "/dev/zero"), ("zero.pt", "/dev/zero"), ("full", "/dev/full"), ("loop", "loop")] {
        symlink(to, folder.join(name)).expect("linked");
    }
}

/// What is in a folder: files with their content, links, and folders.
fn inventory(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let kind = fs::symlink_metadata(&path).expect("a kind").file_type();
        if kind.is_dir() {
            found.extend(inventory(&path));
        }
        let content = if kind.is_file() { fs::read(&path).expect("read") } else { Vec::new() };
        found.insert(path, content);
    }
    found
}

/// What of `before` is no more, or other, and what is new.
fn changes(before: &BTreeMap<PathBuf, Vec<u8>>, after: &BTreeMap<PathBuf, Vec<u8>>) -> Vec<PathBuf> {
    let names = before.keys().chain(after.keys());
    let changed = names.filter(|name| before.get(*name) != after.get(*name));
    changed.cloned().collect()
}

#[test]
fn command_lines() {
    let scratch = tempdir().expect("a folder");
    let syntaxes = syntaxes(scratch.path());
    run("command_lines", 250, |random| {
        let scratch = tempdir().expect("a folder");
        let [folder, home] = ["here", "home"].map(|name| scratch.path().join(name));
        for folder in [&folder, &home] {
            fs::create_dir(folder).expect("made");
        }
        prepare(&folder);
        let before = inventory(scratch.path());
        let line = syntaxes.choose(random).expect("a command").line(random);
        println!("{line:?}");
        let output = ratelab(&line, &folder, &home);
        if refused(&output) {
            let changes = changes(&before, &inventory(scratch.path()));
            assert!(changes.is_empty(), "{line:?} was refused and changed {changes:?}");
        }
    });
}

fn refused(output: &Output) -> bool {
    output.status.code() == Some(2)
}

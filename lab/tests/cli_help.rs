//! Help, completions, manual pages and versions of `ratelab`.

mod support;

use std::{fs::File, path::Path, process::Command};

use ratelab::KnobKind;
use ratelab_cart_pole::BROKEN_HZ;
use support::{Folder, ROOT, Said, User, error_line};

fn said(line: &str) -> Said {
    Folder::new().says(line)
}

/// The commands in the help.
fn commands() -> Vec<String> {
    let help = said("--help");
    let lines = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let lines = lines.take_while(|line| !line.is_empty());
    let names = lines.filter_map(|line| line.split_whitespace().next());
    let names: Vec<String> = names.map(str::to_owned).collect();
    assert!(names.len() > 9, "{names:?}");
    names
}

/// The long options in the help of `command`, without their hyphens.
fn options(command: &str) -> Vec<String> {
    let help = said(&format!("{command} --help"));
    let words = help.lines().map(|line| line.trim_start());
    let options = words.filter_map(|line| line.trim_start_matches("-h, ").strip_prefix("--"));
    let names = options.filter_map(|line| line.split_whitespace().next());
    names.map(str::to_owned).collect()
}

#[test]
fn completions_contain_every_command_and_option() {
    let words = [commands(), options("lab"), options("sweep")].concat();
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let script = said(&format!("completions {shell}"));
        for word in &words {
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
}

#[test]
fn every_command_has_a_page_with_every_option() {
    let folder = Folder::new();
    folder.says("man share/man1");
    let commands = commands();
    for command in commands.iter().filter(|command| *command != "help") {
        let page = folder.read(&format!("share/man1/ratelab-{command}.1"));
        let page = page.replace("\\-", "-");
        let options = options(command);
        assert!(options.contains(&"help".to_owned()), "{options:?}");
        for option in options {
            assert!(page.contains(&format!("--{option}")), "{command}: {option}");
        }
    }
    let written = folder.names("share/man1").len();
    assert_eq!(
        written,
        commands.len(),
        "one for each, but help, and ratelab's"
    );
    let page = Said(folder.read("share/man1/ratelab.1"));
    assert_eq!(page, said("man"), "printed as it is written");
    for heading in ["EXAMPLES", "EXIT STATUS", "ENVIRONMENT", "FILES"] {
        page.has(heading);
    }
}

#[test]
fn a_version_is_one_line_or_the_full_report() {
    let version = concat!("ratelab ", env!("CARGO_PKG_VERSION"));
    let short = said("-V");
    assert!(short.starts_with(version), "{short:?}");
    assert_eq!(short.lines().count(), 1, "{short:?}");
    let long = said("--version");
    let mut lines = long.lines();
    assert_eq!(lines.next(), Some(version));
    let names = lines.map(|line| line.split_whitespace().next().expect("a fact"));
    let facts = "commit date target profile rustc MuJoCo rerun ONNX";
    assert!(names.eq(facts.split(' ')), "{long:?}");
    long.lacks("/");
}

/// The commit of this clone, if it is a clone and git is installed.
fn head() -> Option<String> {
    // A copy without history may lie in another repository.
    if !Path::new(ROOT).join(".git").exists() {
        return None;
    }
    let mut git = Command::new("git");
    let output = git.args(["-C", ROOT, "rev-parse", "HEAD"]).output();
    let output = output.ok().filter(|output| output.status.success())?;
    String::from_utf8(output.stdout).ok()
}

#[test]
fn the_version_contains_the_commit_of_the_clone() {
    let long = said("--version");
    let mut lines = long.lines().map(str::split_whitespace);
    let mut commit = lines.find(|line| line.clone().next() == Some("commit"));
    let commit = commit.as_mut().and_then(|line| line.nth(1));
    let commit = commit.expect("a commit");
    match head() {
        Some(head) => assert!(commit.len() > 6 && head.starts_with(commit), "{long:?}"),
        None => assert_eq!(commit, "unknown"),
    }
}

#[test]
fn help_contains_the_knob_that_breaks_it_and_every_kind_of_knob() {
    let help = said("run --help");
    for text in [
        format!("Break it: control-hz {BROKEN_HZ}\n"),
        format!("decide {BROKEN_HZ} times a second"),
    ] {
        assert_eq!(help.matches(&text).count(), 1, "{text:?} in {help:?}");
    }
    let words: Vec<&str> = help.split_whitespace().collect();
    let help = Said(words.join(" "));
    for kind in KnobKind::ALL {
        help.has(&format!("\"{}\"", kind.usage()));
    }
}

#[test]
fn pages_in_unwritable_places_are_refused_with_a_remedy() {
    let folder = Folder::new();
    folder.write("ratelab.1/in-the-way", "");
    folder.refuses("man .").has("ratelab.1: this is a folder");
}

#[test]
fn a_closed_pipe_is_no_error_and_a_full_disk_is_one() {
    let folder = Folder::new();
    for line in ["--help", "--version", "keys", "man", "completions zsh"] {
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        let output = folder.command(line).stdout(writer).output();
        let output = output.expect("it starts");
        assert!(output.status.success(), "{line}: {output:?}");
        assert!(output.stderr.is_empty(), "{line}: {output:?}");
    }
    let full = || File::options().write(true).open("/dev/full");
    for line in ["--help", "--version"] {
        // There are systems without such a file.
        let Ok(full) = full() else { return };
        let output = folder.command(line).stdout(full).output();
        let said = error_line(line, &output.expect("it starts"), 1);
        said.has("cannot write to standard output");
    }
}

#[test]
fn unknown_arguments_are_refused_with_a_remedy() {
    for (line, advice) in [
        ("rum", "a similar subcommand exists: 'run'"),
        ("run --contol-hz 5", "exists: '--control-hz'"),
        ("run extra", "expected a graph file, which ends in .toml"),
        (
            "run --json x.toml",
            "the graph file stands first, or right behind the command",
        ),
        ("info", "see ratelab info --help"),
        ("keys --all", "see ratelab keys --help"),
        ("lab --fps x", "expected 1 to 120 frames per second"),
        ("exercise check x", "9a, 9b, 10, 11, 12"),
        ("exercise x", "9a, 9b, 10, 11, 12, or check"),
        ("exercise --redo", "as in ratelab exercise 1"),
        ("run --clock wall", "[possible values: real, virtual]"),
    ] {
        let said = Folder::new().refuses(line);
        assert!(said.trim_end().ends_with(advice), "{line}: {said:?}");
    }
}

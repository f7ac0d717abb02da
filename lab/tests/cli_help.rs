//! Help, completions, manual pages and versions of `ratelab`.

mod support;

use std::{
    fs,
    path::Path,
    process::{Command, Stdio},
};

use ratelab::KnobKind;
use ratelab_cart_pole::BROKEN_HZ;
use tempfile::TempDir;

use support::{complaint, path, ratelab, text};

fn said(args: &[&str]) -> String {
    let output = ratelab(args);
    assert!(output.status.success(), "{args:?}: {output:?}");
    text(&output.stdout)
}

/// The commands in the help.
fn commands() -> Vec<String> {
    let help = said(&["--help"]);
    let lines = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let lines = lines.take_while(|line| !line.is_empty());
    let names = lines.filter_map(|line| line.split_whitespace().next());
    let names: Vec<String> = names.map(str::to_owned).collect();
    assert!(names.len() > 9, "{names:?}");
    names
}

/// The long options in the help of `command`, without their hyphens.
fn options(command: &str) -> Vec<String> {
    let help = said(&[command, "--help"]);
    let words = help.lines().map(|line| line.trim_start());
    let options = words.filter_map(|line| line.trim_start_matches("-h, ").strip_prefix("--"));
    let names = options.filter_map(|line| line.split_whitespace().next());
    names.map(str::to_owned).collect()
}

#[test]
fn completions_contain_every_command_and_option() {
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let script = said(&["completions", shell]);
        for command in commands() {
            assert!(script.contains(&command), "{shell}: {command}");
        }
        for option in options("lab").iter().chain(&options("sweep")) {
            assert!(script.contains(option), "{shell}: {option}");
        }
    }
}

#[test]
fn every_command_has_a_page_with_every_option() {
    let folder = TempDir::new().expect("folder");
    let pages = path(&folder, "share/man1");
    said(&["man", &pages]);
    let commands = commands();
    for command in commands.iter().filter(|command| *command != "help") {
        let page = fs::read_to_string(format!("{pages}/ratelab-{command}.1"));
        let page = page.expect(command).replace("\\-", "-");
        let options = options(command);
        assert!(options.contains(&"help".to_owned()), "{options:?}");
        for option in options {
            assert!(page.contains(&format!("--{option}")), "{command}: {option}");
        }
    }
    let written = fs::read_dir(&pages).expect("folder").count();
    assert_eq!(
        written,
        commands.len(),
        "one for each, but help, and ratelab's"
    );
    let page = fs::read_to_string(format!("{pages}/ratelab.1")).expect("page");
    assert_eq!(page, said(&["man"]), "printed as it is written");
    for heading in ["EXAMPLES", "EXIT STATUS", "ENVIRONMENT", "FILES"] {
        assert!(page.contains(heading), "{heading}");
    }
}

#[test]
fn a_version_is_one_line_or_the_full_report() {
    let version = concat!("ratelab ", env!("CARGO_PKG_VERSION"));
    let short = said(&["-V"]);
    assert!(short.starts_with(version), "{short}");
    assert_eq!(short.lines().count(), 1, "{short}");
    let long = said(&["--version"]);
    let mut lines = long.lines();
    assert_eq!(lines.next(), Some(version));
    let names = lines.map(|line| line.split_whitespace().next().expect("a fact"));
    let facts = [
        "commit", "date", "target", "profile", "rustc", "MuJoCo", "rerun", "ONNX",
    ];
    assert!(names.eq(facts), "{long}");
    assert!(!long.contains('/'), "no paths: {long}");
}

/// The commit of this clone, if it is a clone and git is installed.
fn head() -> Option<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    // A copy without history may lie in another repository.
    if !root.join(".git").exists() {
        return None;
    }
    let mut git = Command::new("git");
    let output = git.arg("-C").arg(root).args(["rev-parse", "HEAD"]).output();
    let output = output.ok().filter(|output| output.status.success())?;
    Some(text(&output.stdout))
}

#[test]
fn the_version_contains_the_commit_of_the_clone() {
    let long = said(&["--version"]);
    let mut lines = long.lines().map(str::split_whitespace);
    let mut commit = lines.find(|line| line.clone().next() == Some("commit"));
    let commit = commit.as_mut().and_then(|line| line.nth(1));
    let commit = commit.expect("a commit");
    match head() {
        Some(head) => assert!(commit.len() > 6 && head.starts_with(commit), "{long}"),
        None => assert_eq!(commit, "unknown"),
    }
}

#[test]
fn help_contains_the_knob_that_breaks_it() {
    let help = said(&["run", "--help"]);
    for text in [
        format!("Break it: control-hz {BROKEN_HZ}\n"),
        format!("decide {BROKEN_HZ} times a second"),
    ] {
        assert_eq!(help.matches(&text).count(), 1, "{text:?} in {help}");
    }
}

#[test]
fn help_contains_every_kind_of_knob() {
    let help = said(&["run", "--help"]);
    let words: Vec<&str> = help.split_whitespace().collect();
    let help = words.join(" ");
    for kind in KnobKind::ALL {
        let usage = format!("\"{}\"", kind.usage());
        assert!(help.contains(&usage), "{usage} in {help}");
    }
}

#[test]
fn pages_in_unwritable_places_are_refused_with_a_remedy() {
    let folder = TempDir::new().expect("folder");
    fs::create_dir(folder.path().join("ratelab.1")).expect("in the way");
    let refused = complaint(&ratelab(&["man", &path(&folder, "")]), 2);
    assert!(refused.contains("ratelab.1: this is a folder"), "{refused}");
}

#[test]
fn a_closed_pipe_is_no_error() {
    for args in [
        &["--help"][..],
        &["--version"],
        &["keys"],
        &["man"],
        &["completions", "zsh"],
    ] {
        let mut ratelab = Command::new(env!("CARGO_BIN_EXE_ratelab"));
        let ratelab = ratelab.args(args).stdout(Stdio::piped());
        let mut child = ratelab.stderr(Stdio::piped()).spawn().expect("starts");
        drop(child.stdout.take());
        let output = child.wait_with_output().expect("ends");
        assert!(output.status.success(), "{args:?}: {output:?}");
        assert!(output.stderr.is_empty(), "{args:?}: {output:?}");
    }
}

#[test]
fn unknown_arguments_are_refused_with_a_remedy() {
    for (args, advice) in [
        (&["rum"][..], "a similar subcommand exists: 'run'"),
        (&["run", "--contol-hz", "5"], "exists: '--control-hz'"),
        (
            &["run", "extra"],
            "expected a graph file, which ends in .toml",
        ),
        (
            &["run", "--json", "x.toml"],
            "the graph file stands first, or right behind the command",
        ),
        (&["info"], "see ratelab info --help"),
        (&["keys", "--all"], "see ratelab keys --help"),
        (
            &["lab", "--fps", "x"],
            "expected 1 to 120 frames per second",
        ),
        (&["exercise", "check", "x"], "9a, 9b, 10, 11, 12"),
        (&["exercise", "x"], "9a, 9b, 10, 11, 12, or check"),
        (&["exercise", "--redo"], "as in ratelab exercise 1"),
        (
            &["run", "--clock", "wall"],
            "[possible values: real, virtual]",
        ),
    ] {
        let output = ratelab(args);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert_eq!(said.lines().count(), 1, "{said}");
        assert!(said.trim_end().ends_with(advice), "{said}");
    }
}

//! Help, completions, manual pages and versions of `ratelab`.

use std::{fs::File, path::Path, process::Command};

use ratelab::KnobKind;
use ratelab_cart_pole::BROKEN_HZ;

use crate::support::{Folder, ROOT, Said, error_line};

fn said(line: &str) -> Said {
    Folder::new().says(line)
}

/// The first words of these lines.
fn first_words<'l>(lines: impl Iterator<Item = &'l str>) -> Vec<String> {
    let words = lines.filter_map(|line| line.split_whitespace().next());
    words.map(str::to_owned).collect()
}

/// The commands in the help.
fn commands() -> Vec<String> {
    let help = said("--help");
    let lines = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let names = first_words(lines.take_while(|line| !line.is_empty()));
    assert!(names.len() > 9, "{names:?}");
    names
}

/// The long options in the help of `command`, without their hyphens.
fn options(command: &str) -> Vec<String> {
    let help = said(&format!("{command} --help"));
    let lines = help.lines().map(|line| line.trim_start());
    first_words(lines.filter_map(|line| line.trim_start_matches("-h, ").strip_prefix("--")))
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
    // One for each, but help, and ratelab's.
    assert_eq!(folder.names("share/man1").len(), commands.len());
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
    assert_eq!(long.lines().next(), Some(version));
    let facts = "commit date target profile rustc MuJoCo rerun ONNX";
    assert_eq!(first_words(long.lines().skip(1)).join(" "), facts);
    long.lacks("/");
    let commit = long.lines().find_map(|line| line.strip_prefix("commit"));
    let commit = commit.and_then(|commit| commit.split_whitespace().next());
    let commit = commit.expect("a commit");
    match head() {
        Some(head) => assert!(commit.len() > 6 && head.starts_with(commit), "{long:?}"),
        None => assert_eq!(commit, "unknown"),
    }
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
fn a_closed_pipe_is_no_error_and_a_full_disk_is_one() {
    let folder = Folder::new();
    for line in ["--help", "--version", "keys", "man", "completions zsh"] {
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        let output = folder.command(line).stdout(writer).output();
        let output = output.expect("it starts");
        let silent = output.status.success() && output.stderr.is_empty();
        assert!(silent, "{line}: {output:?}");
    }
    for line in ["--help", "--version"] {
        // There are systems without such a file.
        let Ok(full) = File::options().write(true).open("/dev/full") else {
            return;
        };
        let output = folder.command(line).stdout(full).output();
        let said = error_line(line, &output.expect("it starts"), 1);
        said.has("cannot write to standard output");
    }
    folder.plays("1 ratelab run --smoke --csv /dev/full > said => cannot write /dev/full");
}

//! `ratelab replay`, as used on the command line: in the rerun viewer, or in a terminal.
#![cfg(unix)]

mod support;

use std::{
    fs,
    os::unix::fs::{PermissionsExt, symlink},
    path::Path,
    process::{Command, Output},
};

use support::{Folder, RATELAB, User, error_line};
use tempfile::TempDir;

/// Puts a command `rerun` into `bin`, which prints `version` on request, and otherwise writes
/// its arguments to `given`.
fn install_viewer(folder: &Folder, version: &str) {
    let given = folder.path("given").display().to_string();
    let script = format!(
        "#!/bin/sh\n\
         if [ \"$1\" = --version ]; then echo '{version}'; else echo \"$@\" > {given}; fi\n"
    );
    folder.write("bin/rerun", script);
    let executable = fs::Permissions::from_mode(0o755);
    fs::set_permissions(folder.path("bin/rerun"), executable).expect("executable");
}

/// Replays a recording in `folder` by `program`, with `path` as its search path.
fn replay(folder: &Folder, program: &Path, path: &str) -> Output {
    let mut command = Command::new(program);
    command.args(["replay", "fall-5hz.rrd"]).env("PATH", path);
    let output = command.current_dir(folder.path("")).output();
    output.expect("ratelab starts")
}

/// Checks that the viewer was opened with the recording, without a word.
fn assert_opened(folder: &Folder, output: &Output) {
    let silent = output.stdout.is_empty() && output.stderr.is_empty();
    assert!(output.status.success() && silent, "{output:?}");
    assert_eq!(folder.read("given").trim(), "fall-5hz.rrd");
    fs::remove_file(folder.path("given")).expect("removed");
}

#[test]
fn replay_opens_the_viewer_or_prints_how_to_install_it() {
    let folder = Folder::with(&["recordings/fall-5hz.rrd"]);
    let path = format!("{}:/bin:/usr/bin", folder.path("bin").display());
    let replay = || replay(&folder, Path::new(RATELAB), &path);
    let ours = rerun::build_info().version;
    install_viewer(&folder, &format!("rerun-cli {ours} [rustc 1.92.0]"));
    assert_opened(&folder, &replay());
    // Another version is opened too, with a note.
    install_viewer(&folder, "rerun-cli 0.30.0");
    let note = error_line("another version", &replay(), 0);
    note.has("0.30.0")
        .has(&format!("pip install rerun-sdk=={ours}"));
    install_viewer(&folder, "usage: something else");
    error_line("something else", &replay(), 1).has("not the rerun viewer");
    fs::remove_dir_all(folder.path("bin")).expect("removed");
    let missing = error_line("none", &replay(), 1);
    missing.has("was not found").has("pip install");
}

/// As installed by pip, in an environment that is not activated.
#[test]
fn replay_finds_the_viewer_beside_the_program_through_links_and_without_a_path() {
    // A link to the program, because a copy might still be open for writing.
    let folder = Folder(TempDir::new_in(env!("CARGO_TARGET_TMPDIR")).expect("a folder"));
    folder.copy(&["recordings/fall-5hz.rrd"]);
    let ours = rerun::build_info().version;
    install_viewer(&folder, &format!("rerun-cli {ours} [rustc 1.92.0]"));
    let (program, link) = (folder.path("bin/ratelab"), folder.path("ratelab"));
    fs::hard_link(RATELAB, &program).expect("linked");
    symlink(&program, &link).expect("linked");
    for program in [&program, &link] {
        assert_opened(&folder, &replay(&folder, program, ""));
    }
}

#[test]
fn replay_in_a_terminal_needs_one() {
    let folder = Folder::with(&["recordings/fall-5hz.rrd"]);
    let said = folder.refuses("replay --terminal fall-5hz.rrd");
    said.has("try ratelab info");
}

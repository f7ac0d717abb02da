//! An installed `ratelab`, run in any folder outside of the clone.

mod support;

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use support::{Folder, RATELAB, User, outside::assert_outside};

/// A user with a home folder and a working folder that is no clone.
struct Installed {
    home: Folder,
    work: Folder,
}

impl Installed {
    fn new() -> Self {
        let work = Folder::new();
        assert_outside(&work.path(""));
        Self {
            home: Folder::new(),
            work,
        }
    }
}

impl User for Installed {
    fn program(&self) -> Command {
        let mut program = Command::new(RATELAB);
        program.current_dir(self.work.path(""));
        program.env("HOME", self.home.path(""));
        program.env_remove("XDG_DATA_HOME");
        // No viewer on the search path.
        program.env("PATH", "");
        program
    }
}

/// All files under `folder`.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("a folder");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    paths
        .flat_map(|path| match path.is_dir() {
            true => files(&path),
            false => vec![path],
        })
        .collect()
}

/// The only file in `folder` and below.
fn only_file(folder: &Path) -> PathBuf {
    let mut files = files(folder);
    assert_eq!(files.len(), 1, "{files:?}");
    files.remove(0)
}

#[test]
fn it_needs_no_files_of_the_clone() {
    let user = Installed::new();
    for (line, part) in [
        ("run --smoke", "BALANCED"),
        ("sweep --control-hz 5,10 --seeds 0..1", "2 of 2"),
        ("keys", "show or hide this help"),
        ("exercise check 2", "hold"),
    ] {
        user.says(line).has(part);
    }
    let left = files(&user.work.path(""));
    assert!(left.is_empty(), "nothing was asked for: {left:?}");
}

#[test]
fn recordings_go_to_the_current_folder() {
    let user = Installed::new();
    let said = user.says("run --smoke --record");
    let file = only_file(&user.work.path("recordings"));
    let name = file.file_name().and_then(|name| name.to_str());
    said.has(name.expect("a name"));
    let file = file.display();
    user.says(&format!("info {file}")).has("BALANCED");
    user.says(&format!("verify {file}")).has("identical");
    let (no_viewer, _) = user.fails(&format!("replay {file}"), 1);
    no_viewer.has("replay --terminal");
}

#[test]
fn unwritable_files_are_refused_before_the_run() {
    let user = Installed::new();
    user.work.write("recordings", "in the way");
    for (line, advice) in [
        ("run --record", "choose another name"),
        ("run --csv new/rows.csv", "make it first"),
        ("run --csv .", "name a file in it"),
        ("run --out recordings", "choose another name"),
    ] {
        let said = user.refuses(line);
        assert!(said.trim_end().ends_with(advice), "{line}: {said:?}");
    }
}

#[test]
fn predictions_are_kept_for_the_user() {
    let mut user = Installed::new();
    user.says("exercise 2 --predict '0 because it is'");
    let left = files(&user.work.path(""));
    assert!(left.is_empty(), "they are not kept here: {left:?}");
    let file = only_file(&user.home.path(""));
    assert!(file.ends_with("ratelab/answers.toml"), "{file:?}");
    let list = user.says("exercise");
    list.has("you predicted 0").has(&file.display().to_string());
    // The same user in another folder.
    user.work = Folder::new();
    user.says("exercise").has("you predicted 0");
}

#[test]
fn an_unwritable_file_of_predictions_is_refused_before_the_question() {
    let user = Installed::new();
    user.home.write("none", "in the way");
    let mut exercise = user.command("exercise 2 --predict '0 because it is'");
    let home = user.home.path("none");
    let output = exercise.env("HOME", home).output().expect("starts");
    support::error_line("exercise 2", &output, 2).has("--answers FILE");
}

//! An installed `ratelab`, run in any folder outside of the clone.

mod support;

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use tempfile::TempDir;

use support::{outside::assert_outside, text};

/// A user with a home folder and a working folder that is no clone.
struct User {
    home: TempDir,
    work: TempDir,
}

impl User {
    fn new() -> Self {
        let folder = || TempDir::new().expect("a folder");
        let (home, work) = (folder(), folder());
        assert_outside(work.path());
        Self { home, work }
    }

    fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_ratelab"));
        command.args(args).current_dir(self.work.path());
        command.env("HOME", self.home.path());
        command.env_remove("XDG_DATA_HOME");
        // No viewer on the search path.
        command.env("PATH", "");
        command
    }

    fn does(&self, args: &[&str]) -> Output {
        self.command(args).output().expect("ratelab starts")
    }

    fn succeeds(&self, args: &[&str]) -> String {
        let output = self.does(args);
        assert!(output.status.success(), "{args:?}: {output:?}");
        text(&output.stdout)
    }

    /// The single error line of a refused command.
    fn is_refused(&self, args: &[&str], code: i32) -> String {
        let output = self.does(args);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{args:?}: {said}");
        assert_eq!(said.lines().count(), 1, "{said}");
        said
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

#[test]
fn it_needs_no_files_of_the_clone() {
    let user = User::new();
    assert!(user.succeeds(&["run", "--smoke"]).contains("BALANCED"));
    let swept = user.succeeds(&["sweep", "--control-hz", "5,10", "--seeds", "0..1"]);
    assert!(swept.contains("2 of 2"), "{swept}");
    assert!(user.succeeds(&["keys"]).contains("show or hide this help"));
    assert!(user.succeeds(&["exercise", "check", "2"]).contains("hold"));
    assert!(files(user.work.path()).is_empty(), "nothing was asked for");
}

#[test]
fn recordings_go_to_the_current_folder() {
    let user = User::new();
    let said = user.succeeds(&["run", "--smoke", "--record"]);
    let made = files(&user.work.path().join("recordings"));
    let [file] = &made[..] else {
        panic!("{made:?}");
    };
    let name = file.file_name().and_then(|name| name.to_str());
    assert!(said.contains(name.expect("a name")), "{said}");
    let file = file.display().to_string();
    assert!(user.succeeds(&["info", &file]).contains("BALANCED"));
    assert!(user.succeeds(&["verify", &file]).contains("identical"));
    let no_viewer = user.is_refused(&["replay", &file], 1);
    assert!(no_viewer.contains("replay --terminal"), "{no_viewer}");
}

#[test]
fn unwritable_files_are_refused_before_the_run() {
    let user = User::new();
    fs::write(user.work.path().join("recordings"), "in the way").expect("written");
    for (args, advice) in [
        (&["run", "--record"][..], "choose another name"),
        (&["run", "--csv", "new/rows.csv"], "make it first"),
        (&["run", "--csv", "."], "name a file in it"),
        (&["run", "--out", "recordings"], "choose another name"),
    ] {
        let said = user.is_refused(args, 2);
        assert!(said.trim_end().ends_with(advice), "{said}");
    }
}

#[test]
fn predictions_are_kept_for_the_user() {
    let user = User::new();
    user.succeeds(&["exercise", "2", "--predict", "0 because it is"]);
    assert!(files(user.work.path()).is_empty(), "they are not kept here");
    let kept = files(user.home.path());
    let [file] = &kept[..] else {
        panic!("{kept:?}");
    };
    assert!(file.ends_with("ratelab/answers.toml"), "{file:?}");
    let list = user.succeeds(&["exercise"]);
    assert!(list.contains("you predicted 0"), "{list}");
    assert!(list.contains(&file.display().to_string()), "{list}");
    // The same user in another folder.
    let elsewhere = TempDir::new().expect("a folder");
    let mut list = user.command(&["exercise"]);
    let list = list.current_dir(&elsewhere).output().expect("starts");
    assert!(text(&list.stdout).contains("you predicted 0"), "{list:?}");
}

#[test]
fn an_unwritable_file_of_predictions_is_refused_before_the_question() {
    let user = User::new();
    let none = user.home.path().join("none");
    fs::write(&none, "in the way").expect("written");
    let mut exercise = user.command(&["exercise", "2", "--predict", "0 because it is"]);
    let output = exercise.env("HOME", &none).output().expect("starts");
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("--answers FILE"), "{said}");
}

//! Files that change, or go away, while the lab uses them.

use std::{
    fs,
    path::{Path, PathBuf},
};

use ratelab::Command;

use super::*;
use crate::session::OpenRows;

/// A folder with a file for the weights of a policy.
fn folder() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("folder");
    let file = folder.path().join("x.safetensors");
    write(&file, "patient.safetensors");
    (folder, file)
}

/// Writes the weights of that name, from the folder of policies.
fn write(file: &Path, name: &str) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../policies");
    let weights = fs::read(folder.join(name)).expect("weights");
    fs::write(file, weights).expect("written");
}

/// A run that goes on, of the policy in `file`.
fn config_of(file: &Path) -> Config {
    let config = endless(&format!("policy {}", file.display()));
    config.resolved(&CartPole::default()).expect("weights")
}

/// The policy that a run of `config` begins with.
fn policy(config: &Config) -> Option<String> {
    config.setup.message("policy").map(str::to_owned)
}

#[test]
fn a_policy_that_was_written_anew_runs_after_a_restart() {
    let started = |app: &App| policy(app.shown.run.config());
    for keys in ["r", "n", "m\n"] {
        let (_folder, file) = folder();
        let mut app = session(config_of(&file));
        sample(&mut app);
        let first = started(&app);
        write(&file, "prompt.safetensors");
        press(&mut app, keys);
        until(&mut app, |app| started(app) != first);
        assert_eq!(started(&app), policy(&config_of(&file)), "{keys:?}");
        leave(app);
    }
}

#[test]
fn a_policy_that_is_gone_leaves_the_run_as_it_is() {
    for keys in ["r", "n", "N", "m\n"] {
        let (_folder, file) = folder();
        let mut app = session(Config {
            seed: 7,
            ..config_of(&file)
        });
        sample(&mut app);
        fs::remove_file(&file).expect("removed");
        press(&mut app, keys);
        shows(said(&app), &["x.safetensors"]);
        assert!(!app.ended(), "{keys:?} ended the run");
        // The next restart is not of what was refused.
        write(&file, "patient.safetensors");
        press(&mut app, "r");
        assert_eq!(app.shown.run.config().seed, 7, "{keys:?}");
        leave(app);
    }
}

#[test]
fn a_refused_policy_is_not_what_the_next_key_goes_on_from() {
    let (_folder, file) = folder();
    let refused = policy(&config_of(&file)).expect("a policy");
    write(&file, "prompt.safetensors");
    let mut app = session(endless(""));
    let knob = knob(&format!("send policy {refused}"));
    // Unchecked.
    app.shown.run.send(knob.clone().into());
    app.knobs.pending.push(knob);
    until(&mut app, |app| !app.shown.events.is_empty());
    shows(said(&app), &["SHA-256"]);
    press(&mut app, "p");
    until(&mut app, |app| app.shown.events.len() > 1);
    let swapped = app.shown.events[1].to_string();
    shows(&swapped, &["policy: lqr (was scripted)"]);
    leave(app);
}

#[test]
fn a_recording_that_cannot_begin_lets_the_run_go_on() {
    let folder = tempfile::tempdir().expect("folder");
    let place = folder.path().join("recordings");
    fs::create_dir(&place).expect("a folder");
    let mut app = opened(recording_to(&place), &endless(""));
    press(&mut app, "w");
    until(&mut app, |app| said(app).contains("recorded"));
    press(&mut app, "w");
    // A file is where the folder was: nothing can be recorded there.
    fs::remove_dir_all(&place).expect("removed");
    fs::write(&place, "").expect("a file");
    press(&mut app, "r");
    // The recorder that runs may notice first that its file is gone.
    let noticed = ["cannot record", "the file is gone from its folder"];
    let notice = said(&app);
    assert!(noticed.iter().any(|why| notice.contains(why)), "{notice:?}");
    assert!(!app.ended());
    let left = left(app);
    left.ended.expect("no fault");
    assert!(left.unrecorded.is_some(), "the exit code tells nothing");
}

/// Makes the file at `path` when a session begins.
fn rows_to(path: PathBuf) -> OpenRows {
    Arc::new(move || {
        let path = path.clone();
        Ok(Box::new(move || Ok(Box::new(fs::File::create(path)?) as _)))
    })
}

#[test]
fn rows_go_to_a_file_that_stays_until_the_next_run_begins() {
    let (folder, policy) = folder();
    let file = folder.path().join("rows.csv");
    let rows = || fs::read_to_string(&file).map_or(0, |rows| rows.lines().count());
    let setup = SessionSetup {
        csv: Some(rows_to(file.clone())),
        ..setup()
    };
    let mut app = opened(setup, &config_of(&policy));
    until(&mut app, |_| rows() > 3);
    fs::remove_file(&policy).expect("removed");
    press(&mut app, "r");
    assert!(rows() > 3);
    app.shown.run.send(Command::Stop);
    until(&mut app, App::ended);
    let steps = left(app).ended.expect("no fault").summary.steps;
    assert_eq!(rows() as u64, steps + 1);
}

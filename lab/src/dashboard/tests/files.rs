//! Files that change, or go away, while the lab uses them.

use std::{fs, path::Path};

use ratelab::{Command, Knob, Speed, Time};
use ratelab_study::experiment::Config;

use super::*;
use crate::{dashboard::sampler::RunSource, recording::Destination};

/// A run that goes on, of the policy in `file`.
fn config_of(file: &Path) -> Config {
    let knob = format!("policy {}", file.display());
    let config = Config {
        end: Time::MAX,
        speed: Speed::REAL_TIME,
        ..CartPole::config(&knob).expect("a knob")
    };
    config.resolved(&CartPole::default()).expect("weights")
}

/// The weights of that name, from the folder of policies.
fn weights(name: &str) -> Vec<u8> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../policies");
    fs::read(folder.join(name)).expect("weights")
}

/// The policy that a run of `config` begins with.
fn policy(config: &Config) -> Option<String> {
    config.setup.message("policy").map(str::to_owned)
}

/// The policy that the session was started with.
fn started(app: &App) -> Option<String> {
    policy(app.desk().run.config())
}

/// Does all that is to be done before `what` is so.
fn until(app: &mut App, what: impl Fn(&App) -> bool) {
    while !what(app) {
        app.sample().expect("no fault");
        std::thread::yield_now();
    }
}

#[test]
fn a_policy_that_was_written_anew_runs_after_a_restart() {
    for keys in ["r", "n", "m\n"] {
        let folder = tempfile::tempdir().expect("folder");
        let file = folder.path().join("x.safetensors");
        fs::write(&file, weights("patient.safetensors")).expect("written");
        let mut app = App::new(&config_of(&file), setup()).expect("session");
        app.sample().expect("no fault");
        let first = started(&app);
        fs::write(&file, weights("prompt.safetensors")).expect("written");
        press(&mut app, keys);
        until(&mut app, |app| started(app) != first);
        assert_eq!(started(&app), policy(&config_of(&file)), "{keys:?}");
        app.finish().ended.expect("no fault");
    }
}

#[test]
fn a_policy_that_is_gone_leaves_the_run_as_it_is() {
    for keys in ["r", "n", "N", "m\n"] {
        let folder = tempfile::tempdir().expect("folder");
        let file = folder.path().join("x.safetensors");
        fs::write(&file, weights("patient.safetensors")).expect("written");
        let config = Config {
            seed: 7,
            ..config_of(&file)
        };
        let mut app = App::new(&config, setup()).expect("session");
        app.sample().expect("no fault");
        fs::remove_file(&file).expect("removed");
        press(&mut app, keys);
        let notice = app.desk().notice.clone().unwrap_or_default();
        assert!(notice.contains("x.safetensors"), "{keys:?}: {notice:?}");
        assert!(!app.ended(), "{keys:?} ended the run");
        // The next restart is not of what was refused.
        fs::write(&file, weights("patient.safetensors")).expect("written");
        press(&mut app, "r");
        assert_eq!(app.desk().run.config().seed, 7, "{keys:?}");
        app.finish().ended.expect("no fault");
    }
}

#[test]
fn a_refused_policy_is_not_what_the_next_key_goes_on_from() {
    let folder = tempfile::tempdir().expect("folder");
    let file = folder.path().join("x.safetensors");
    fs::write(&file, weights("patient.safetensors")).expect("written");
    let refused = policy(&config_of(&file)).expect("a policy");
    fs::write(&file, weights("prompt.safetensors")).expect("written");
    let config = Config {
        end: Time::MAX,
        speed: Speed::REAL_TIME,
        ..Config::default()
    };
    let mut app = App::new(&config, setup()).expect("session");
    app.press_unchecked(Knob::Send {
        node: "policy".to_owned(),
        text: refused,
    });
    until(&mut app, |app| app.events(Time::MAX).next().is_some());
    let notice = app.desk().notice.clone().unwrap_or_default();
    assert!(notice.contains("SHA-256"), "{notice:?}");
    press(&mut app, "p");
    until(&mut app, |app| app.events(Time::MAX).nth(1).is_some());
    let swapped = app.events(Time::MAX).nth(1).map(ToString::to_string);
    assert!(swapped.is_some_and(|event| event.contains("policy: lqr (was scripted)")));
    app.finish().ended.expect("no fault");
}

#[test]
fn a_recording_that_cannot_begin_lets_the_run_go_on() {
    let folder = tempfile::tempdir().expect("folder");
    let place = folder.path().join("recordings");
    fs::create_dir(&place).expect("a folder");
    let setup = SessionSetup {
        record: Some(Destination::new(Some(place.clone()))),
        ..setup()
    };
    let config = Config {
        end: Time::MAX,
        speed: Speed::REAL_TIME,
        ..Config::default()
    };
    let mut app = App::new(&config, setup).expect("session");
    press(&mut app, "w");
    until(&mut app, |app| {
        app.desk()
            .notice
            .as_deref()
            .is_some_and(|n| n.contains("recorded"))
    });
    press(&mut app, "w");
    // A file is where the folder was: nothing can be recorded there.
    fs::remove_dir_all(&place).expect("removed");
    fs::write(&place, "").expect("a file");
    press(&mut app, "r");
    let notice = app.desk().notice.clone().unwrap_or_default();
    // The recorder that runs may notice first that its file is gone.
    let noticed = ["cannot record", "the file is gone from its folder"];
    assert!(noticed.iter().any(|why| notice.contains(why)), "{notice:?}");
    assert!(!app.ended());
    let left = app.finish();
    left.ended.expect("no fault");
    assert!(left.unrecorded.is_some(), "the exit code tells nothing");
}

#[test]
fn rows_go_to_a_file_that_stays_until_the_next_run_begins() {
    let folder = tempfile::tempdir().expect("folder");
    let (policy, rows) = (
        folder.path().join("x.safetensors"),
        folder.path().join("rows.csv"),
    );
    fs::write(&policy, weights("patient.safetensors")).expect("written");
    let setup = SessionSetup {
        csv: Some(rows.clone()),
        ..setup()
    };
    let mut app = App::new(&config_of(&policy), setup).expect("session");
    until(&mut app, |_| {
        fs::read_to_string(&rows).is_ok_and(|rows| rows.lines().count() > 3)
    });
    fs::remove_file(&policy).expect("removed");
    press(&mut app, "r");
    assert!(fs::read_to_string(&rows).expect("rows").lines().count() > 3);
    app.desk().run.send(Command::Stop);
    until(&mut app, App::ended);
    let steps = app.finish().ended.expect("no fault").summary.steps;
    let written = fs::read_to_string(&rows).expect("rows");
    assert_eq!(written.lines().count() as u64, steps + 1);
}

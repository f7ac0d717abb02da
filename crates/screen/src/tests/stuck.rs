//! Leaving a run, and starting again, while a node is stuck in its tick.

use crossbeam_channel::{Sender, bounded};

use super::*;

/// A lab over a run whose policy is in a tick that ends when the sender is gone.
fn stuck() -> (App, Sender<()>) {
    let (begun, begins) = bounded(1);
    let (held, release) = bounded(1);
    let decides = move || {
        let _ = begun.try_send(());
        let _ = release.recv();
        Action(0.0)
    };
    let app = opened(deciding(decides), &endless("real"));
    begins.recv().expect("the policy ticks");
    (app, held)
}

#[test]
fn leaving_tells_what_it_waits_for_and_leaves_when_that_has_come() {
    let (mut app, held) = stuck();
    press(&mut app, "q");
    sample(&mut app);
    assert!(!app.quit, "it does not wait");
    for drawn in [small(&app), large(&app)] {
        let told = "waiting for policy, still in a tick: q again or Ctrl-C ends without it";
        shows(&drawn, &[told]);
    }
    drop(held);
    until(&mut app, |app| app.quit);
    left(app).ended.expect("it ended in order");
}

#[test]
fn a_second_q_leaves_at_once() {
    for keys in ["qq", "rq"] {
        let (mut app, held) = stuck();
        press(&mut app, keys);
        assert!(app.quit, "{keys}");
        let error = left(app).ended.expect_err("it did not end").to_string();
        shows(&error, &["policy is still in a tick"]);
        drop(held);
    }
}

#[test]
fn a_restart_comes_when_the_node_is_done() {
    let (mut app, held) = stuck();
    let told = "waiting for policy, still in a tick: q or Ctrl-C ends without it";
    then(&mut app, "r", &[told]);
    drop(held);
    until(&mut app, |app| !app.ended() && app.notice.is_none());
    assert!(!app.quit && !app.ended());
    press(&mut app, "q");
    left(app).ended.expect("the new run ended in order");
}

#[test]
fn the_recording_of_a_run_that_is_left_stuck_is_complete() {
    let folder = tempfile::tempdir().expect("folder");
    let (mut app, held) = stuck();
    app.recordings.destination = Some(folder.path().to_owned()).into();
    press(&mut app, "wqq");
    let left = left(app);
    left.ended.expect_err("it did not end");
    assert_eq!(left.recorded.len(), 1);
    let recording = Recording::read(&left.recorded[0].path).expect("readable");
    assert_eq!(recording.defect(), None);
    drop(held);
}

#[test]
fn run_time_stands_still_while_the_program_is_stopped() {
    let paused = |app: &App| app.shown.run.observer().status().paused;
    for clock in ["", "real"] {
        let mut app = session(endless(clock));
        sample(&mut app);
        app.rest();
        assert!(paused(&app));
        app.go_on();
        until(&mut app, |app| !paused(app));
        // A pause that the person wanted stays.
        press(&mut app, " ");
        app.rest();
        app.go_on();
        until(&mut app, paused);
        leave(app);
    }
}

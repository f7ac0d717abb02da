//! Leaving a run of the real clock at a moment, with a knob turned.

use std::{fs, path::Path};

use ratelab::ClockKind;

use super::{super::player::Player, *};
use crate::recording::{Destination, Recording};

/// A policy that needs too long for its pole.
fn slow() -> Config {
    Config {
        clock: ClockKind::Real,
        end: Time::from_secs_f64(2.0).expect("a time"),
        ..CartPole::config("takes policy 230").expect("a knob")
    }
}

/// The verdict after the end of a branch.
fn branched(app: &mut App) -> String {
    app.sample().expect("no fault");
    while !app.ended() {
        app.sample().expect("no fault");
    }
    app.sample().expect("no fault");
    verdict(app)
}

#[test]
fn a_run_of_the_real_clock_is_left_where_one_looks_and_stays_up_without_the_delay() {
    let mut app = ended(slow());
    app.key(&KeyEvent::new(KeyCode::Home, KeyModifiers::NONE))
        .expect("obeyed");
    press(&mut app, "B");
    assert!(screen(&app, &PLAIN, 160, 50).contains("the knob to turn at"));
    press(&mut app, "takes nobody 0\n");
    assert!(
        app.desk().prompt.refusal().is_some(),
        "it begins all the same"
    );
    for _ in 0.."takes nobody 0".len() {
        app.key(&KeyEvent::new(KeyCode::Backspace, KeyModifiers::NONE))
            .expect("obeyed");
    }
    press(&mut app, "takes policy 0\n");
    let saved = branched(&mut app);
    for part in ["BALANCED", "fell at", "takes policy 0 from", "on: balanced"] {
        assert!(saved.contains(part), "no {part:?} in {saved}");
    }
    let screen = app.screen().expect("a frame");
    assert_eq!(screen.frame.status.clock, ClockKind::Virtual);
    let ghost = screen.trace.expect("a signal").ghost;
    assert!(!ghost.points.is_empty(), "the run that was left is gone");
    // Another knob at the same moment.
    press(&mut app, "Btakes policy 250\n");
    let lost = branched(&mut app);
    assert!(lost.contains("on: fell at"), "{lost}");
}

fn recorded(folder: &Path) -> Arc<Recording> {
    let setup = SessionSetup {
        record: Some(Destination::new(Some(folder.to_owned()))),
        ..setup()
    };
    let mut app = App::new(&slow(), setup).expect("session");
    while !app.ended() {
        app.sample().expect("no fault");
    }
    app.finish().ended.expect("no fault");
    let mut files = fs::read_dir(folder).expect("a folder");
    let file = files.next().expect("a file").expect("readable");
    Arc::new(Recording::read(&file.path()).expect("a recording"))
}

#[test]
fn a_recording_is_left_at_a_moment_and_goes_on_in_the_lab() {
    let folder = tempfile::tempdir().expect("a folder");
    let recording = recorded(folder.path());
    let at = Time::from_secs_f64(0.2).expect("a time");
    let mut player = Player::still(recording, &setup().system, at);
    for key in chars("Btakes policy 0\n") {
        player
            .key(&KeyEvent::new(key, KeyModifiers::NONE))
            .expect("obeyed");
    }
    assert!(player.wants_quit());
    let branch = player.into_branch().expect("readable").expect("a branch");
    let (branch, sampler) = branch;
    let mut app = App::of_branch(branch, sampler, setup());
    let left = |app: &App| {
        app.screen()
            .is_some_and(|screen| screen.frame.now > at + Duration::from_millis(1_000))
    };
    while !left(&app) {
        app.sample().expect("no fault");
    }
    let saved = verdict(&app);
    assert!(saved.contains("; now with "), "{saved}");
    let ghost = app
        .screen()
        .and_then(|screen| screen.trace)
        .map(|trace| trace.ghost);
    assert!(
        ghost.is_some_and(|ghost| !ghost.points.is_empty()),
        "the recorded run is gone"
    );
    let left = app.finish();
    assert!(left.change.is_some_and(|so| so.contains("on: stopped at ")));
}

/// Opens the run that is executed again.
fn back(app: &mut App) {
    press(app, ",");
    let playing = |app: &App| app.screen().is_some_and(|screen| screen.scrubber.is_some());
    while !playing(app) {
        app.sample().expect("no fault");
    }
}

fn shown(app: &App) -> (Time, u64) {
    let screen = app.screen().expect("a frame");
    let ticks = screen.frame.nodes.iter().map(|node| node.ticks).sum();
    (screen.frame.now, ticks)
}

#[test]
fn a_run_of_the_real_clock_that_is_over_is_stepped_through_tick_by_tick_and_left_there() {
    let mut app = ended(slow());
    let (end, all) = shown(&app);
    back(&mut app);
    // A thread may have ticked once more after the end that the lab shows.
    assert_eq!(shown(&app).1, all, "the run is another one");
    let mut ticks = vec![all];
    for _ in 0..20 {
        press(&mut app, ",");
        app.sample().expect("no fault");
        ticks.push(shown(&app).1);
    }
    assert!(ticks.is_sorted_by(|one, next| next <= one), "{ticks:?}");
    assert!(
        ticks.windows(2).all(|pair| pair[0] - pair[1] <= 1),
        "{ticks:?}"
    );
    let (then, fewer) = shown(&app);
    assert!(then < end && fewer < all);
    // Forwards again, to the same moment.
    press(&mut app, ",.");
    app.sample().expect("no fault");
    assert_eq!(shown(&app), (then, fewer));
    press(&mut app, "q");
    assert_eq!((shown(&app), app.desk().quit), ((end, all), false));
    back(&mut app);
    app.key(&KeyEvent::new(KeyCode::Home, KeyModifiers::NONE))
        .expect("obeyed");
    press(&mut app, "Btakes policy 0\n");
    let saved = branched(&mut app);
    assert!(saved.contains("on: balanced"), "{saved}");
}

#[test]
fn a_step_back_in_a_world_of_its_own_keeps_the_age_of_the_pushes() {
    let mut app = ended(Config {
        world: WorldKind::OWN,
        ..slow()
    });
    back(&mut app);
    let age = |app: &App| app.screen().and_then(|screen| screen.frame.age);
    assert!(age(&app).is_some());
    press(&mut app, ",,");
    app.sample().expect("no fault");
    assert!(age(&app).is_some(), "it has to be played first");
}

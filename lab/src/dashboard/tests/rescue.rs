//! A rescue by hand.

use super::*;
use crate::dashboard::sampler::RunSource;

/// Begins a rescue by hand, in steps, recorded to `folder`.
fn begun(folder: &std::path::Path) -> App {
    let mut app = running();
    app.record_to(folder);
    app.rescue_by_hand();
    while app.by_hand().is_none() {
        app.sample().expect("no fault");
    }
    press(&mut app, " ");
    app
}

/// Goes on until the screen of the default terminal shows `text`.
fn until(app: &mut App, text: &str) {
    while !screen(app, &PLAIN, 80, 24).contains(text) {
        assert!(
            !app.ended() || text.contains("no rescue"),
            "{text:?}:\n{}",
            screen(app, &PLAIN, 80, 24)
        );
        step(app);
    }
}

fn now(app: &App) -> Time {
    app.desk().run.observer().snapshot().now
}

/// Runs one tick of one node, and waits for it.
fn step(app: &mut App) {
    let ticks = |app: &App| -> u64 {
        let nodes = app.desk().run.observer().snapshot().nodes;
        nodes.iter().map(|node| node.ticks).sum()
    };
    let before = ticks(app);
    press(app, ".");
    while ticks(app) == before && !app.ended() {
        app.sample().expect("no fault");
    }
    app.sample().expect("no fault");
}

fn shows(app: &mut App, text: &str) {
    app.sample().expect("no fault");
    let drawn = screen(app, &PLAIN, 80, 24);
    assert!(drawn.contains(text), "no {text:?} in\n{drawn}");
}

#[test]
fn a_rescue_shows_each_step_and_is_judged_when_it_is_over() {
    let folder = tempfile::TempDir::new().expect("a folder");
    let mut app = begun(folder.path());
    until(&mut app, "rescue: b slows the policy to 5 Hz");
    for level in ["+12°", "+4°", "−4°", "−12°"] {
        shows(&mut app, level);
    }
    // From here a rescue is possible.
    while now(&app) < Time::from_nanos(1_000_000_000) {
        step(&mut app);
    }
    press(&mut app, "b");
    until(&mut app, "wait until the pole is beyond ±4°");
    until(&mut app, "now! ] ] ] brings 50 Hz back");
    press(&mut app, "e");
    shows(&mut app, "e again gives it up");
    press(&mut app, "]]]");
    assert_eq!(rate(&app, "policy"), Some(50.0));
    until(&mut app, "it must stay within ±4° for 3.0 s more");
    press(&mut app, "e");
    shows(&mut app, "e again gives it up");
    until(&mut app, "rescued! e judges it");
    press(&mut app, "e");
    shows(&mut app, "✓ rescued");
}

#[test]
fn a_pole_that_fell_is_no_rescue_and_r_tries_again() {
    let folder = tempfile::TempDir::new().expect("a folder");
    let mut app = begun(folder.path());
    press(&mut app, "b");
    until(&mut app, "no rescue: e says why, r tries again");
    press(&mut app, "r");
    while app.ended() {
        app.sample().expect("no fault");
    }
    until(&mut app, "rescue: b slows the policy to 5 Hz");
}

#[test]
fn breaking_it_again_brings_the_rate_back() {
    let mut app = running();
    press(&mut app, "bb");
    assert_eq!(rate(&app, "policy"), Some(50.0));
}

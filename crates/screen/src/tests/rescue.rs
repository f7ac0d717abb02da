//! A rescue by hand, and the exercises over a running session.

use super::*;
use crate::course::PanelAction;

/// Begins a rescue by hand, in steps, recorded to `folder`.
fn begun(folder: &Path) -> App {
    let mut app = running();
    app.recordings.destination = Some(folder.to_owned()).into();
    app.try_by_hand();
    until(&mut app, |app| app.course.by_hand.is_some());
    press(&mut app, " ");
    app
}

/// Goes on, tick by tick, until the screen of the default terminal shows `text`.
fn step_until(app: &mut App, text: &str) {
    while !small(app).contains(text) {
        let goes_on = !app.ended() || text.contains("no rescue");
        assert!(goes_on, "{text:?}:\n{}", small(app));
        step(app);
    }
}

/// Runs one tick of one node, and waits for it.
fn step(app: &mut App) {
    let ticks = |app: &App| {
        let nodes = app.shown.graph().nodes.into_iter();
        nodes.map(|node| node.ticks).sum::<u64>()
    };
    let before = ticks(app);
    press(app, ".");
    until(app, |app| ticks(app) != before || app.ended());
    sample(app);
}

const NOT_YET: &[&str] = &["e again gives it up"];

#[test]
fn a_rescue_shows_each_step_and_is_judged_when_it_is_over() {
    let folder = tempfile::TempDir::new().expect("a folder");
    let mut app = begun(folder.path());
    step_until(&mut app, "rescue: b slows the policy to 5 Hz");
    then(&mut app, "", &["+12°", "+4°", "−4°", "−12°"]);
    // From here a rescue is possible.
    while app.shown.graph().now < seconds(1.0) {
        step(&mut app);
    }
    press(&mut app, "b");
    step_until(&mut app, "wait until the pole is beyond ±4°");
    step_until(&mut app, "now! ] ] ] brings 50 Hz back");
    then(&mut app, "e", NOT_YET);
    press(&mut app, "]]]");
    assert_eq!(rate(&app, "policy"), Some(50.0));
    step_until(&mut app, "it must stay within ±4° for 3.0 s more");
    then(&mut app, "e", NOT_YET);
    step_until(&mut app, "rescued! e judges it");
    then(&mut app, "e", &["accepted: true, rescued"]);
}

#[test]
fn a_pole_that_fell_is_no_rescue_and_r_tries_again() {
    let folder = tempfile::TempDir::new().expect("a folder");
    let mut app = begun(folder.path());
    press(&mut app, "b");
    step_until(&mut app, "no rescue: e says why, r tries again");
    press(&mut app, "r");
    until(&mut app, |app| !app.ended());
    step_until(&mut app, "rescue: b slows the policy to 5 Hz");
}

#[test]
fn breaking_it_again_brings_the_rate_back() {
    let mut app = running();
    press(&mut app, "bb");
    assert_eq!(rate(&app, "policy"), Some(50.0));
}

#[test]
fn a_cause_is_covered_until_the_exercise_that_asks_for_it_is_answered() {
    let exercise = exercises::find(10).expect("an exercise");
    let scene = exercise.scene(0).expect("settings").expect("a scene");
    let mut app = running();
    app.follow_panel(PanelAction::Watch(Box::new(scene)));
    press(&mut app, "0+++");
    end(&mut app);
    let drawn = large(&app);
    shows(&drawn, &["the cause is covered"]);
    assert!(!drawn.contains("age comes from"), "{drawn}");
    app.follow_panel(PanelAction::Answered);
    sample(&mut app);
    shows(&large(&app), &["age comes from"]);
}

//! The exercises over a running session.

use super::*;
use crate::dashboard::exercise_panel::PanelAction;

/// The end of the run to look at in exercise 10.
fn watching() -> App {
    let exercise = exercises::find(10).expect("an exercise");
    let scene = exercise.scene(0).expect("settings").expect("a scene");
    let mut app = running();
    app.follow_panel(PanelAction::Watch(Box::new(scene)))
        .expect("a session");
    press(&mut app, "0+++");
    while !app.ended() {
        app.sample().expect("no fault");
    }
    app.sample().expect("no fault");
    app
}

#[test]
fn a_cause_is_covered_until_the_exercise_that_asks_for_it_is_answered() {
    let mut app = watching();
    let drawn = screen(&app, &PLAIN, 160, 50);
    assert!(drawn.contains("the cause is covered"), "{drawn}");
    assert!(!drawn.contains("the age arose"), "{drawn}");
    app.follow_panel(PanelAction::Answered).expect("no fault");
    app.sample().expect("no fault");
    let drawn = screen(&app, &PLAIN, 160, 50);
    assert!(drawn.contains("the age arose"), "{drawn}");
}

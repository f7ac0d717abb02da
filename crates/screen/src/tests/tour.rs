//! The guided tour over a session.

use super::*;
use crate::tour::Guide;

/// Goes to a step of the tour, counted from 1.
fn at_step(app: &mut App, step: usize) {
    app.guide(Guide::Tour);
    press(app, &"\n".repeat(step - 1));
}

#[test]
fn a_step_of_the_tour_leaves_graph_plant_and_verdict_in_sight() {
    let mut app = fallen();
    at_step(&mut app, 2);
    let [small, large] = [small(&app), large(&app)];
    for drawn in [&small, &large] {
        shows(drawn, &["tour 2 of 7", "FELL at", "policy", "plant"]);
    }
    insta::assert_snapshot!("tour_80x24", small);
    insta::assert_snapshot!("tour_160x50", large);
}

#[test]
fn keys_of_the_tour_reach_the_lab_and_esc_leaves_the_tour() {
    let mut app = running();
    at_step(&mut app, 2);
    for _ in 0..4 {
        shows(&small(&app), &["Enter skips this"]);
        press(&mut app, "[");
    }
    assert_eq!(rate(&app, "policy"), Some(20.0));
    until(&mut app, |app| small(app).contains("20 Hz"));
    shows(&small(&app), &["Enter goes on"]);
    press(&mut app, "\u{1b}");
    assert!(!small(&app).contains("tour"));
    leave(app);
}

#[test]
fn the_tour_is_offered_in_a_notice_and_begun_by_a_key() {
    let mut app = running();
    app.guide(Guide::Offer);
    then(&mut app, "", &["g: a tour of five minutes"]);
    then(&mut app, "g", &["tour 1 of 7"]);
    leave(app);
}

#[test]
fn a_fall_goes_on_with_the_tour_whichever_key_it_came_from() {
    for keys in ["b", "[[[[[[[[[[[["] {
        let mut app = running();
        press(&mut app, "+++++");
        at_step(&mut app, 3);
        press(&mut app, keys);
        until(&mut app, |app| small(app).contains("FELL at"));
        shows(&small(&app), &["The pole has fallen.", "Enter goes on"]);
        leave(app);
    }
}

#[test]
fn the_tour_never_says_what_the_run_is_not() {
    for (step, keys, said) in [
        (2, "", "This run is over: r starts again"),
        (5, "", "The policy is set to 5 Hz"),
        (5, "]]]]]]]]", "r starts again, with the policy at 20 Hz"),
        (6, "c", "this run is over: r starts again, then c"),
        (7, "", "? shows all keys"),
    ] {
        let mut app = ended(config("control-hz 5"));
        at_step(&mut app, step);
        press(&mut app, keys);
        let text = app
            .screen()
            .and_then(|screen| screen.aside)
            .expect("a step")
            .text;
        shows(&text, &[said]);
        for untrue in ["stays up", "is up", "jitter:"] {
            assert!(!text.contains(untrue), "{step} {keys}: {text}");
        }
    }
}

#[test]
fn the_map_asks_for_the_prediction_of_what_it_shows_once() {
    let mut app = session(endless(""));
    app.ask_before_the_map();
    for (title, shown) in [
        ("the map is the answer to exercise 1", true),
        ("cliff map", false),
    ] {
        then(&mut app, "m", &[title]);
        assert_eq!(small(&app).contains("m: show the map"), shown, "{title}");
    }
    leave(app);
}

//! The guided tour over a session.

use super::*;
use crate::dashboard::tour::Guide;

fn press(app: &mut App, code: KeyCode) {
    let key = KeyEvent::new(code, KeyModifiers::NONE);
    app.key(&key).expect("no fault");
}

#[test]
fn a_step_of_the_tour_leaves_graph_plant_and_verdict_in_sight() {
    let mut app = fallen();
    app.guide(Guide::Tour);
    press(&mut app, KeyCode::Enter);
    let [small, large] = [(80, 24), (160, 50)].map(|(w, h)| screen(&app, &PLAIN, w, h));
    for drawn in [&small, &large] {
        for part in ["tour 2 of 7", "FELL at", "policy", "plant"] {
            assert!(drawn.contains(part), "{part:?} is missing in\n{drawn}");
        }
    }
    insta::assert_snapshot!("tour_80x24", small);
    insta::assert_snapshot!("tour_160x50", large);
}

#[test]
fn keys_of_the_tour_reach_the_lab_and_esc_leaves_the_tour() {
    let mut app = running();
    app.guide(Guide::Tour);
    press(&mut app, KeyCode::Enter);
    for _ in 0..4 {
        assert!(screen(&app, &PLAIN, 80, 24).contains("Enter skips this"));
        press(&mut app, KeyCode::Char('['));
    }
    let rate = app.wanted().setup.rate("policy").expect("a rate");
    assert_eq!(rate.get(), 20.0);
    while !screen(&app, &PLAIN, 80, 24).contains("20 Hz") {
        app.sample().expect("no fault");
    }
    assert!(screen(&app, &PLAIN, 80, 24).contains("Enter goes on"));
    press(&mut app, KeyCode::Esc);
    assert!(!screen(&app, &PLAIN, 80, 24).contains("tour"));
    app.finish().ended.expect("no fault");
}

#[test]
fn the_tour_is_offered_in_a_notice_and_begun_by_a_key() {
    let mut app = running();
    app.guide(Guide::Offer);
    assert!(screen(&app, &PLAIN, 80, 24).contains("g: a tour of five minutes"));
    press(&mut app, KeyCode::Char('g'));
    assert!(screen(&app, &PLAIN, 80, 24).contains("tour 1 of 7"));
    app.finish().ended.expect("no fault");
}

/// Goes on to a step of the tour, counted from 1.
fn at_step(app: &mut App, step: usize) {
    app.guide(Guide::Tour);
    (1..step).for_each(|_| press(app, KeyCode::Enter));
}

/// Samples until the screen shows `text`.
fn until(app: &mut App, text: &str) {
    while !screen(app, &PLAIN, 80, 24).contains(text) {
        app.sample().expect("no fault");
    }
}

#[test]
fn a_fall_goes_on_with_the_tour_whichever_key_it_came_from() {
    for keys in ["b", "[[[[[[[[[[[["] {
        let mut app = running();
        super::press(&mut app, "+++++");
        at_step(&mut app, 3);
        super::press(&mut app, keys);
        until(&mut app, "FELL at");
        let drawn = screen(&app, &PLAIN, 80, 24);
        for part in ["The pole has fallen.", "Enter goes on"] {
            assert!(drawn.contains(part), "{keys}: no {part:?} in\n{drawn}");
        }
        app.finish().ended.expect("no fault");
    }
}

#[test]
fn the_tour_never_says_what_the_run_is_not() {
    let cases = [
        (2, "", "This run is over: r starts again"),
        (5, "", "The policy is set to 5 decisions"),
        (5, "]]]]]]]]", "r starts again, with 20 decisions"),
        (6, "c", "this run is over: r starts again, then c"),
        (7, "", "? shows all keys"),
    ];
    for (step, keys, said) in cases {
        let mut app = ended(CartPole::config("control-hz 5").expect("a knob"));
        at_step(&mut app, step);
        super::press(&mut app, keys);
        let frame = app.screen().expect("a frame");
        let text = frame.aside.expect("a step").text;
        assert!(text.contains(said), "{step} {keys}: {text}");
        for untrue in ["stays up", "is up", "jitter:"] {
            assert!(!text.contains(untrue), "{step} {keys}: {text}");
        }
    }
}

#[test]
fn the_map_asks_for_the_prediction_of_what_it_shows_once() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("answers.toml");
    let mut app = running();
    app.ask_before_the_map(file);
    for (title, shown) in [("the map answers exercise 1", true), ("cliff map", false)] {
        super::press(&mut app, "m");
        let drawn = screen(&app, &PLAIN, 80, 24);
        assert!(drawn.contains(title), "{drawn}");
        assert_eq!(drawn.contains("m again shows"), shown, "{drawn}");
    }
    app.finish().ended.expect("no fault");
}

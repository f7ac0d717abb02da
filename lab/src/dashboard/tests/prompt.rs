//! Typing knobs: completion, history, and what is given back.

use ratelab::Knob;

use super::*;

fn key(app: &mut App, code: KeyCode) {
    app.key(&KeyEvent::new(code, KeyModifiers::NONE))
        .expect("obeyed");
}

/// What is typed after `typed` and so many times Tab.
fn completed(typed: &str, tabs: usize) -> Option<String> {
    let mut app = running();
    press(&mut app, &format!(":{typed}"));
    (0..tabs).for_each(|_| key(&mut app, KeyCode::Tab));
    app.desk().prompt.typed().map(str::to_owned)
}

#[test]
fn tab_completes_names_then_targets_then_choices_and_goes_round() {
    for (typed, tabs, expected) in [
        ("con", 1, "control-hz "),
        ("rate po", 1, "rate policy "),
        ("rate ", 2, "rate policy "),
        ("rate ", 4, "rate sensor "),
        ("depth /a", 1, "depth /action "),
        ("policy l", 1, "policy lqr"),
        ("send policy ", 2, "send policy lqr"),
        // The name is whole, and what follows it is completed.
        ("pol", 2, "policy scripted"),
        ("nothing", 1, "nothing"),
        ("rate nobody ", 1, "rate nobody "),
    ] {
        let found = completed(typed, tabs);
        assert_eq!(found.as_deref(), Some(expected), "{typed:?} and {tabs} Tab");
    }
}

#[test]
fn up_and_down_go_through_what_was_entered() {
    let mut app = running();
    press(&mut app, ":rate policy 20\n:rate sensor 30\n:dep");
    let mut seen = Vec::new();
    for code in [
        KeyCode::Up,
        KeyCode::Up,
        KeyCode::Up,
        KeyCode::Down,
        KeyCode::Down,
    ] {
        key(&mut app, code);
        seen.push(app.desk().prompt.typed().unwrap_or_default().to_owned());
    }
    let (first, last) = ("rate policy 20", "rate sensor 30");
    assert_eq!(seen, [last, first, first, last, "dep"]);
    assert_eq!(rate(&app, "policy"), Some(20.0));
}

#[test]
fn what_is_refused_is_given_back_and_what_is_allowed_is_printed_in_full() {
    for (typed, allowed) in [
        ("control-hz 0", "control-hz 0"),
        ("rate nobody 5", "expected sensor, policy, actuator"),
        ("depth /nowhere 5", "expected /obs, /action, /state"),
        (
            "rubbish 5",
            "control-hz, sensor-hz, queue-depth, policy, think-ms, on-stale, rate, depth, send",
        ),
        ("policy none.pt", "none.pt: expected"),
        ("rate policy", "expected rate NODE HZ"),
    ] {
        let mut app = running();
        press(&mut app, &format!(":{typed}\n"));
        assert_eq!(
            app.desk().prompt.typed(),
            Some(typed),
            "it is not given back"
        );
        let refusal = app.desk().prompt.refusal().expect("a refusal").to_owned();
        if typed != allowed {
            assert!(refusal.contains(allowed), "{refusal}");
        }
        assert!(!app.wanted().setup.iter().any(|_| true), "{typed} stays");
        // All of it is on the screen, in as many lines as it takes.
        let narrow = screen(&app, &PLAIN, 40, 12).replace(['"', '\n'], " ");
        let drawn: Vec<&str> = narrow.split_whitespace().collect();
        for word in refusal
            .replace('"', " ")
            .split_whitespace()
            .filter(|word| word.len() < 30)
        {
            assert!(drawn.contains(&word), "{word} of {refusal:?} in {narrow}");
        }
        // Edited, it is accepted.
        (0..typed.len()).for_each(|_| key(&mut app, KeyCode::Backspace));
        press(&mut app, "control-hz 7.5\n");
        assert_eq!(
            (app.desk().prompt.typed(), rate(&app, "policy")),
            (None, Some(7.5))
        );
    }
}

#[test]
fn a_knob_that_no_graph_would_take_is_refused_after_the_run_too() {
    let mut app = ended(Config::default());
    press(&mut app, ":send sensor hello\n");
    assert!(
        app.desk()
            .prompt
            .refusal()
            .is_some_and(|why| why.contains("sensor"))
    );
    assert_eq!(app.wanted().setup.iter().count(), 0);
    press(&mut app, "r");
    app.key(&KeyEvent::new(KeyCode::Esc, KeyModifiers::NONE))
        .expect("obeyed");
    press(&mut app, "r");
    app.sample().expect("no fault");
    assert_eq!(app.desk().notice, None);
}

#[test]
fn a_knob_of_any_node_counts_for_the_next_run() {
    let mut app = ended(Config::default());
    press(&mut app, ":offset actuator 5\n");
    assert!(
        app.desk()
            .notice
            .as_deref()
            .is_some_and(|n| n.contains("offset actuator 5"))
    );
    press(&mut app, "r");
    let setup = app.wanted().setup;
    let offset = |knob: &Knob| matches!(knob, Knob::Offset { node, .. } if node == "actuator");
    assert!(setup.iter().any(offset));
}

#[test]
fn knobs_of_time_are_completed_and_turned() {
    let mut app = running();
    press(&mut app, ":takes pol");
    key(&mut app, KeyCode::Tab);
    assert_eq!(app.desk().prompt.typed(), Some("takes policy "));
    press(&mut app, "30..60\n:offset sensor 5\n:wakes actuator 1\n");
    let knobs = app.wanted().setup;
    let knobs: Vec<String> = knobs.iter().map(ToString::to_string).collect();
    let expected = ["takes policy 30..60", "offset sensor 5", "wakes actuator 1"];
    assert_eq!(knobs, expected);
}

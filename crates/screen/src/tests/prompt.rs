//! Typing knobs: completion, history, and what is given back.

use super::*;

#[test]
fn tab_completes_names_then_targets_then_choices_and_goes_round() {
    for (typed, tabs, expected) in [
        ("con", 1, "control-hz "),
        ("rate po", 1, "rate policy "),
        ("rate ", 2, "rate policy "),
        ("rate ", 4, "rate sensor "),
        ("depth /a", 1, "depth /action "),
        ("takes pol", 1, "takes policy "),
        ("policy l", 1, "policy lqr"),
        ("send policy ", 2, "send policy lqr"),
        // The name is whole, and what follows it is completed.
        ("pol", 2, "policy scripted"),
        ("nothing", 1, "nothing"),
        ("rate nobody ", 1, "rate nobody "),
    ] {
        let mut app = running();
        press(&mut app, &format!(":{typed}{}", "\t".repeat(tabs)));
        let found = app.prompt.typed();
        assert_eq!(found, Some(expected), "{typed:?}, {tabs} times Tab");
    }
}

#[test]
fn up_and_down_go_through_what_was_entered() {
    let mut app = running();
    press(&mut app, ":rate policy 20\n:rate sensor 30\n:dep");
    let (first, last) = ("rate policy 20", "rate sensor 30");
    for (key, shown) in [
        ("↑", last),
        ("↑", first),
        ("↑", first),
        ("↓", last),
        ("↓", "dep"),
    ] {
        press(&mut app, key);
        assert_eq!(app.prompt.typed(), Some(shown));
    }
    assert_eq!(rate(&app, "policy"), Some(20.0));
}

#[test]
fn what_is_refused_is_given_back_and_what_is_allowed_is_printed_in_full() {
    for [typed, allowed] in rows(
        "control-hz 0 |
         rate nobody 5 | expected sensor, policy, actuator
         depth /nowhere 5 | expected /obs, /action, /state
         rubbish 5 | control-hz, sensor-hz, queue-depth, policy, think-ms, on-stale, observe, \
             chunk, plan, expect-delay
         policy none.pt | none.pt: expected
         rate policy | expected rate NODE HZ",
    ) {
        let mut app = running();
        press(&mut app, &format!(":{typed}\n"));
        assert_eq!(app.prompt.typed(), Some(&*typed), "it is not given back");
        let refusal = app.prompt.refusal().expect("a refusal").to_owned();
        shows(&refusal, &[&allowed]);
        assert_eq!(set(&app), [""; 0], "{typed} stays");
        // All of it is on the screen, in as many lines as it takes.
        let narrow = screen(&app, 40, 12).replace(['"', '\n'], " ");
        let drawn: Vec<&str> = narrow.split_whitespace().collect();
        let words = refusal.replace('"', " ");
        for word in words.split_whitespace().filter(|word| word.len() < 30) {
            assert!(drawn.contains(&word), "{word} of {refusal:?} in {narrow}");
        }
        // Edited, it is accepted.
        press(&mut app, &"\u{7f}".repeat(typed.len()));
        press(&mut app, "control-hz 7.5\n");
        assert_eq!(app.prompt.typed(), None);
        assert_eq!(rate(&app, "policy"), Some(7.5));
    }
}

#[test]
fn a_knob_that_no_graph_would_take_is_refused_after_the_run_too() {
    let mut app = ended(Config::default());
    press(&mut app, ":send sensor hello\n");
    shows(app.prompt.refusal().expect("a refusal"), &["sensor"]);
    assert_eq!(set(&app), [""; 0]);
    press(&mut app, "r\u{1b}r");
    sample(&mut app);
    assert_eq!(app.notice, None);
}

#[test]
fn a_knob_of_any_node_counts_for_the_next_run() {
    let mut app = ended(Config::default());
    press(&mut app, ":offset actuator 5\n");
    shows(said(&app), &["offset actuator 5"]);
    press(&mut app, "r");
    assert_eq!(set(&app), ["offset actuator 5"]);
}

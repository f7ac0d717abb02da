//! Keys for links, and what faults look like.

use super::*;

#[test]
fn keys_delay_the_marked_topic_and_let_it_lose() {
    let mut app = running();
    for (keys, link) in [
        ("ttdddD", "link /action delay:10"),
        ("llD", "link /action delay:5,loss:0.05"),
        ("DLLL", "link /action none"),
    ] {
        press(&mut app, keys);
        assert_eq!(set(&app), [link]);
    }
    assert_eq!(said(&app), "the loss of /action is at its lowest, 0");
}

#[test]
fn keys_leave_the_other_parts_of_a_link() {
    let mut app = running();
    press(&mut app, "tt:link /action delay:5..9,in-order\nl");
    assert_eq!(set(&app), ["link /action delay:5..9,in-order,loss:0.01"]);
    press(&mut app, "d");
    assert_eq!(set(&app).len(), 1);
    shows(&screen(&app, 120, 36), &["the delay is drawn"]);
}

#[test]
fn a_crashed_node_is_seen_until_it_is_restarted() {
    let mut app = running();
    for (knob, seen) in [(":crash policy\n", true), (":restart policy\n", false)] {
        press(&mut app, knob);
        until(&mut app, |app| {
            screen(app, 120, 36).contains("✖ crashed") == seen
        });
    }
}

/// A run with `knobs` from the start that is over, its cures tried.
fn over(knobs: &str) -> App {
    let mut app = ended(config(knobs));
    until(&mut app, |app| !frame(app).awaits_limits);
    app
}

/// The lines of the screen without quotes.
fn lines(app: &App) -> Vec<String> {
    let drawn = small(app);
    let lines = drawn.lines().map(|line| line.trim_matches('"').to_owned());
    lines.collect()
}

#[test]
fn age_verdict_and_cause_keep_their_rows_whatever_happens() {
    for [setup, verdict, cause] in rows(
        "rate policy 5 | FELL at 0.840 s | the policy decides
         hang policy 900 | FELL at 0.620 s | from the policy: it hung
         crash policy | FELL at 0.620 s | the policy crashed
         crash sensor | FELL at 0.620 s | the sensor crashed
         link /obs loss:1 | FELL at 0.620 s | from /obs: its link lost 31 of 31
         crash actuator | UNDECIDED (the plant never moved) | the actuator crashed
         link /obs delay:120; link /action delay:120; rate sensor 5 | FELL at | age comes from",
    ) {
        let lines = lines(&over(&setup));
        for (row, part) in [(1, "push age"), (2, &*verdict), (3, &*cause)] {
            assert!(lines[row].contains(part), "{setup}: {part:?} in {lines:#?}");
        }
    }
}

#[test]
fn what_the_screen_advises_fixes_the_next_run() {
    for setup in [
        "hang policy 3000",
        "hang sensor 3000",
        "crash policy",
        "crash sensor",
        "link /obs loss:1",
        "takes policy 700",
    ] {
        let mut app = over(setup);
        let drawn = lines(&app)[2..6]
            .join(" ")
            .split_whitespace()
            .collect::<Vec<_>>()
            .join(" ");
        let (advice, _) = drawn.split_once(" fixes it").expect(&drawn);
        let (_, advice) = advice.rsplit_once(':').expect("a key");
        press(&mut app, &format!(":{advice}\nr"));
        end(&mut app);
        let verdict = &app.shown.run.summary().expect("ended").verdict;
        assert_eq!(verdict.name(), "balanced", "{setup:?}: {advice}");
    }
}

#[test]
fn a_plant_that_stands_still_is_said_to_and_goes_on_as_advised() {
    let mut app = running();
    // A crash before the first step would be another case: the plant never moved.
    until(&mut app, |app| {
        let graph = app.shown.graph();
        graph.topic("/state").map(|steps| steps.published) > Some(0)
    });
    press(&mut app, ":crash actuator\n");
    let says = |app: &App, part: &str| lines(app)[2..5].join("").contains(part);
    for part in [
        "STANDS STILL: the last step of the plant was at",
        "the actuator crashed: the plant waits for it. :restart actuator goes on",
    ] {
        until(&mut app, |app| says(app, part));
    }
    press(&mut app, ":restart actuator\n");
    // Whether the pole is still up depends on the moment of the crash.
    until(&mut app, |app| !says(app, "STANDS STILL"));
}

//! Keys for links, and what faults look like.

use super::*;
use crate::dashboard::sampler::RunSource;

/// The knobs that are set.
fn set(app: &App) -> Vec<String> {
    let setup = app.wanted().setup;
    setup.iter().map(ToString::to_string).collect()
}

#[test]
fn keys_delay_the_marked_topic_and_let_it_lose() {
    let mut app = running();
    press(&mut app, "ttdddD");
    assert_eq!(set(&app), ["link /action delay:10"]);
    press(&mut app, "llD");
    assert_eq!(set(&app), ["link /action delay:5,loss:0.05"]);
    press(&mut app, "DLLL");
    assert_eq!(set(&app), ["link /action none"]);
    let drawn = screen(&app, &PLAIN, 120, 36);
    assert!(
        drawn.contains("the loss of /action is at its lowest, 0"),
        "{drawn}"
    );
}

#[test]
fn keys_leave_the_other_parts_of_a_link() {
    let mut app = running();
    press(&mut app, "tt:link /action delay:5..9,in-order\nl");
    assert_eq!(set(&app), ["link /action delay:5..9,in-order,loss:0.01"]);
    press(&mut app, "d");
    assert_eq!(set(&app).len(), 1);
    let drawn = screen(&app, &PLAIN, 120, 36);
    assert!(drawn.contains("the delay is drawn"), "{drawn}");
}

#[test]
fn a_crashed_node_is_seen_until_it_is_restarted() {
    let mut app = running();
    let wait = |app: &mut App, seen: bool| {
        while screen(app, &PLAIN, 120, 36).contains("✖ crashed") != seen {
            app.sample().expect("no fault");
        }
    };
    press(&mut app, ":crash policy\n");
    wait(&mut app, true);
    press(&mut app, ":restart policy\n");
    wait(&mut app, false);
}

/// A run with `setup` that is over, its cures tried.
fn over(setup: &[&str]) -> App {
    let setup = setup.iter().map(|text| text.parse().expect("a knob"));
    let mut app = ended(Config {
        setup: setup.collect(),
        ..Config::default()
    });
    prove(&mut app);
    app
}

/// Waits until what would mend the run was tried.
fn prove(app: &mut App) {
    while app
        .screen()
        .is_some_and(|screen| screen.frame.awaits_limits)
    {
        app.sample().expect("no fault");
    }
}

/// The rows of the screen without quotes.
fn rows(app: &App) -> Vec<String> {
    let drawn = screen(app, &PLAIN, 80, 24);
    let rows = drawn.lines().map(|line| line.trim_matches('"').to_owned());
    rows.collect()
}

#[test]
fn age_verdict_and_cause_keep_their_rows_whatever_happens() {
    for (setup, verdict, cause) in [
        (
            &["rate policy 5"][..],
            "FELL at 0.840 s",
            "the policy decides",
        ),
        (
            &["hang policy 900"],
            "FELL at 0.620 s",
            "in the policy: it hung",
        ),
        (&["crash policy"], "FELL at 0.620 s", "the policy crashed"),
        (&["crash sensor"], "FELL at 0.620 s", "the sensor crashed"),
        (
            &["link /obs loss:1"],
            "FELL at 0.620 s",
            "on /obs: its link lost 31 of 31",
        ),
        (
            &["crash actuator"],
            "UNDECIDED (the plant never moved)",
            "the actuator crashed",
        ),
        (
            &[
                "link /obs delay:120",
                "link /action delay:120",
                "rate sensor 5",
            ],
            "FELL at",
            "the age arose",
        ),
    ] {
        let rows = rows(&over(setup));
        for (row, part) in [(1, "push age"), (2, verdict), (3, cause)] {
            assert!(
                rows[row].contains(part),
                "{setup:?}: {part:?} in\n{}",
                rows.join("\n")
            );
        }
    }
}

#[test]
fn what_the_screen_advises_mends_the_next_run() {
    for setup in [
        &["hang policy 3000"][..],
        &["hang sensor 3000"],
        &["crash policy"],
        &["crash sensor"],
        &["link /obs loss:1"],
        &["takes policy 700"],
    ] {
        let mut app = over(setup);
        let drawn = rows(&app)[2..6].join(" ");
        let drawn = drawn.split_whitespace().collect::<Vec<_>>().join(" ");
        let (advice, _) = drawn.split_once(" mends it").expect(&drawn);
        let (_, advice) = advice.rsplit_once(':').expect("a key");
        press(&mut app, &format!(":{advice}\nr"));
        while !app.ended() {
            app.sample().expect("no fault");
        }
        let verdict = app.desk().run.summary().expect("ended").verdict;
        assert_eq!(verdict.name(), "balanced", "{setup:?}: {advice}");
    }
}

#[test]
fn a_plant_that_stands_still_is_said_to_and_goes_on_as_advised() {
    let mut app = running();
    // A crash before the first step would be another case: the plant never moved.
    let has_moved = |app: &App| {
        let graph = app.desk().run.observer().snapshot();
        graph
            .topic("/state")
            .is_some_and(|steps| steps.published > 0)
    };
    while !has_moved(&app) {
        app.sample().expect("no fault");
    }
    press(&mut app, ":crash actuator\n");
    let wait = |app: &mut App, part: &str| {
        while !rows(app)[2..5].join("").contains(part) {
            app.sample().expect("no fault");
        }
    };
    wait(&mut app, "STANDS STILL: the last step of the plant was at");
    wait(
        &mut app,
        "the actuator crashed: the plant waits for it. :restart actuator goes on",
    );
    press(&mut app, ":restart actuator\n");
    // Whether the pole is still up depends on the moment of the crash.
    while rows(&app)[2..5].join("").contains("STANDS STILL") {
        app.sample().expect("no fault");
    }
}

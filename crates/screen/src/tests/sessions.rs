//! What keys do to a session, and how sessions end.

use std::{collections::VecDeque, io, sync::atomic::AtomicBool, time::Instant};

use crossterm::event::{Event, KeyCode, KeyEvent, KeyModifiers};

use super::*;
use crate::{
    Options, obey_until, run,
    terminal::{BACKLOG, Input},
};

/// The knobs that were turned in a run that goes on.
fn turned(app: App) -> Vec<String> {
    let summary = left(app).ended.expect("no fault").summary;
    let knobs = summary.knobs();
    knobs.iter().map(|timed| timed.knob.to_string()).collect()
}

#[test]
fn keys_and_typed_values_turn_the_knobs_of_the_running_graph() {
    for [keys, knobs] in rows(
        r"[[}> | rate policy 40; rate policy 30; rate sensor 60; depth /obs 2; depth /action 2
          :control-hz 7.5\n | rate policy 7.5
          :takes policy 30..60\n:offset sensor 5\n | takes policy 30..60; offset sensor 5
          :wakes actuator 1\n | wakes actuator 1",
    ) {
        let mut app = session(endless(""));
        press(&mut app, &keys);
        assert_eq!(turned(app).join("; "), knobs, "{keys}");
    }
}

/// Nobody types.
struct Nobody;

impl Input for Nobody {
    fn next(&mut self, timeout: Duration) -> io::Result<Option<Event>> {
        thread::sleep(timeout);
        Ok(None)
    }
}

/// Somebody typed all of these before the frame.
struct Typed(VecDeque<char>);

impl Input for Typed {
    fn next(&mut self, _: Duration) -> io::Result<Option<Event>> {
        let key = self.0.pop_front();
        Ok(key.map(|key| Event::Key(KeyEvent::from(KeyCode::Char(key)))))
    }
}

#[test]
fn a_frame_that_came_late_takes_all_the_keys_that_wait() {
    let mut app = running();
    let mut keys = Typed("[".repeat(3).chars().collect());
    let touched = obey_until(Instant::now(), &mut keys, &mut app);
    assert!(touched.expect("no fault"));
    let rates = ["rate policy 40", "rate policy 30", "rate policy 25"];
    assert_eq!(turned(app), rates);
    let mut flood = Typed("x".repeat(3 * BACKLOG).chars().collect());
    let taken = obey_until(Instant::now(), &mut flood, &mut running());
    assert!(taken.expect("no fault"));
    assert_eq!(flood.0.len(), 2 * BACKLOG, "keys for the next frames");
}

/// Runs the real loop over `app` until it fails.
fn fault(app: &mut App) -> String {
    let options = Options {
        fps: 30,
        theme: RICH,
        ask_background: false,
        quit_on_signal: Arc::default,
    };
    let quit = AtomicBool::new(false);
    let ended = run(&mut terminal(120, 40), &mut Nobody, app, &options, &quit);
    ended.expect_err("a fault").to_string()
}

#[test]
fn a_node_that_fails_or_panics_ends_the_dashboard_with_its_fault() {
    let not_finite: fn() -> Action = || Action(f32::NAN);
    let panics: fn() -> Action = || panic!("out of ideas");
    for (decides, said) in [
        (not_finite, "must be finite"),
        (panics, "panicked: out of ideas"),
    ] {
        for run in ["until ever", "until ever; real"] {
            let mut app = opened(deciding(decides), &config(run));
            let fault = fault(&mut app);
            shows(&fault, &["\"policy\"", said]);
            assert_eq!(fault.lines().count(), 1);
        }
    }
}

#[test]
fn a_session_that_nobody_watched_for_long_still_ends_at_once() {
    // Flat out, the taps are full long before this is over.
    let app = session(config("until ever"));
    thread::sleep(Duration::from_secs(2));
    leave(app);
}

#[test]
fn keys_go_on_from_where_the_timed_knobs_led() {
    let mut app = session(config("speed 10; until ever; 0 control-hz 20"));
    until(&mut app, |app| !app.shown.events.is_empty());
    sample(&mut app);
    press(&mut app, "[");
    assert_eq!(turned(app), ["rate policy 20", "rate policy 15"]);
}

#[test]
fn keys_count_even_before_the_graph_has_heard_of_the_last() {
    let mut app = session(endless(""));
    press(&mut app, "  cccc");
    let summary = left(app).ended.expect("no fault").summary;
    let told: Vec<String> = summary.events.iter().map(|e| e.to_string()).collect();
    for (what, count) in [
        ("pause", 1),
        ("resume", 1),
        ("refused", 0),
        ("real clock", 2),
        ("virtual clock", 2),
    ] {
        let found = told.iter().filter(|event| event.contains(what)).count();
        assert_eq!(found, count, "{what} in {told:?}");
    }
}

#[test]
fn control_c_leaves_while_a_value_is_being_typed() {
    let mut app = ended(Config::default());
    press(&mut app, ":con");
    app.key(&KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL));
    assert!(app.quit);
}

#[test]
fn a_pause_is_one_picture_however_long_it_lasts() {
    let mut app = session(endless(""));
    press(&mut app, " ");
    let begun = Instant::now();
    while begun.elapsed() < Duration::from_millis(2500) {
        sample(&mut app);
        thread::sleep(Duration::from_millis(10));
    }
    press(&mut app, ",");
    let kept = app.shown.frames.position().map_or(1, |(_, kept)| kept);
    assert!(kept <= 4, "{kept} pictures of a graph that stood still");
    leave(app);
}

#[test]
fn a_key_that_cannot_be_obeyed_says_why() {
    let mut app = ended(Config::default());
    for [keys, reason] in rows(
        r"< | the depth of /obs and /action is at its lowest, 1
          :control-hz 1000\n] | the rate of policy is at its highest, 1000 Hz",
    ) {
        press(&mut app, &keys);
        assert_eq!(said(&app), reason);
    }
    let mut app = session(endless("real"));
    sample(&mut app);
    for (key, reason) in [("+", "no speed"), (".", "cannot step")] {
        press(&mut app, key);
        shows(said(&app), &[reason]);
    }
    leave(app);
}

#[test]
fn a_policy_is_swapped_while_the_run_goes_on_and_the_status_says_so() {
    let mut app = session(endless(""));
    press(&mut app, "p");
    sample(&mut app);
    let policy = |app: &App| frame(app).settings.join(", ");
    until(&mut app, |app| policy(app) != "policy scripted");
    // Those that drop the pole come last.
    assert_eq!(policy(&app), "policy lqr");
    assert!(!verdict(&app).contains("FELL"));
    assert_eq!(turned(app), ["send policy lqr"]);
}

#[test]
fn the_smallest_screen_shows_that_the_world_waits_where_it_matters() {
    for (knob, waits) in [
        ("control-hz 40", false),
        ("think-ms 30", true),
        ("link /action delay:10", true),
        ("hang policy 50", true),
    ] {
        let drawn = small(&ended(config(knob)));
        assert_eq!(drawn.contains("world: waits"), waits, "{knob}: {drawn}");
    }
}

#[test]
fn a_key_starts_again_in_the_other_world_and_back() {
    let mut app = ended(config("control-hz 40"));
    assert!(!large(&app).contains("world"), "course");
    press(&mut app, "o");
    sample(&mut app);
    shows(&large(&app), &["world: own", " world "]);
    assert_eq!(app.wanted().world.name(), "own");
    assert_eq!(rate(&app, "policy"), Some(40.0));
    press(&mut app, "o");
    assert_eq!(app.wanted().world.name(), "course");
}

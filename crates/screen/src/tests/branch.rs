//! Leaving a run of the real clock at a moment, with a knob turned.

use super::*;

/// A policy that needs too long for its pole.
const SLOW: &str = "real; until 2; takes policy 230";

/// The verdict after the end of a branch.
fn branched(app: &mut App) -> String {
    sample(app);
    end(app);
    verdict(app)
}

/// Whether the run that was left is there to be compared with.
fn has_ghost(app: &App) -> bool {
    let trace = app.screen().and_then(|screen| screen.trace);
    trace.is_some_and(|trace| !trace.ghost.points.is_empty())
}

#[test]
fn a_run_of_the_real_clock_is_left_where_one_looks_and_stays_up_without_the_delay() {
    let mut app = ended(config(SLOW));
    press(&mut app, "⇱B");
    shows(&large(&app), &["the knob to turn at"]);
    press(&mut app, "takes nobody 0\n");
    assert!(app.prompt.refusal().is_some(), "it begins all the same");
    press(&mut app, &"\u{7f}".repeat(14));
    press(&mut app, "takes policy 0\n");
    let saved = branched(&mut app);
    let parts = ["BALANCED", "fell at", "takes policy 0 from", "on: balanced"];
    shows(&saved, &parts);
    assert_eq!(frame(&app).status.clock, ClockKind::Virtual);
    assert!(has_ghost(&app), "the run that was left is gone");
    // Another knob at the same moment.
    press(&mut app, "Btakes policy 250\n");
    shows(&branched(&mut app), &["on: fell at"]);
}

#[test]
fn a_recording_is_left_at_a_moment_and_goes_on_in_the_lab() {
    let at = seconds(0.2);
    let mut app = App::for_recording(Arc::new(recorded(setup(), &config(SLOW), 0.0)), setup());
    app.jump(at);
    press(&mut app, "Btakes policy 0\n");
    sample(&mut app);
    until(&mut app, |app| frame(app).now > at + Duration::from_secs(1));
    shows(&verdict(&app), &["; now with "]);
    assert!(has_ghost(&app), "the recorded run is gone");
    press(&mut app, "[");
    assert_eq!(rate(&app, "policy"), Some(40.0));
    shows(&left(app).change.expect("a branch"), &["on: stopped at "]);
}

/// Opens the run that is executed again.
fn back(app: &mut App) {
    press(app, ",");
    until(app, |app| {
        app.screen().is_some_and(|screen| screen.scrubber.is_some())
    });
}

/// The run times at which the ticks of the run begin.
fn tick_times(app: &App) -> Vec<Time> {
    let (run, nodes) = (&app.shown.run, 0..frame(app).nodes.len());
    let ticks = nodes.flat_map(|node| run.lineage().ticks(node));
    ticks.map(|worked| worked.tick.at).collect()
}

fn shown(app: &App) -> (Time, u64) {
    (frame(app).now, ticks(app))
}

#[test]
fn a_run_of_the_real_clock_that_is_over_is_stepped_through_tick_by_tick_and_left_there() {
    let mut app = ended(config(SLOW));
    let (end, all) = shown(&app);
    back(&mut app);
    // A thread may have ticked once more after the end that the lab shows.
    assert_eq!(shown(&app).1, all, "the run is another one");
    // Not by their number: two threads may tick at the same nanosecond.
    let begun = tick_times(&app);
    assert!(begun.len() as u64 >= all, "ticks of the run are missing");
    for _ in 0..20 {
        let after = frame(&app).now;
        press(&mut app, ",");
        sample(&mut app);
        let now = frame(&app).now;
        let between = begun.iter().find(|at| now < **at && **at < after);
        assert_eq!(between, None, "stepped over from {after:?} to {now:?}");
    }
    let (then, fewer) = shown(&app);
    assert!(then < end && fewer < all);
    // Forwards again, to the same moment.
    press(&mut app, ",.");
    sample(&mut app);
    assert_eq!(shown(&app), (then, fewer));
    press(&mut app, "q");
    assert_eq!((shown(&app), app.quit), ((end, all), false));
    back(&mut app);
    press(&mut app, "⇱Btakes policy 0\n");
    shows(&branched(&mut app), &["on: balanced"]);
}

#[test]
fn a_step_back_in_a_world_of_its_own_keeps_the_age_of_the_pushes() {
    let mut app = ended(config(&format!("own; {SLOW}")));
    back(&mut app);
    assert!(frame(&app).age.is_some());
    press(&mut app, ",,");
    sample(&mut app);
    assert!(frame(&app).age.is_some(), "it has to be played first");
}

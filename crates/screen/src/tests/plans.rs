//! Plans under what was played of them, and what they have to do with a fall.

use super::*;
use crate::frame::PlanData;

/// A run of the policy that thinks for 200 ms about each chunk, with more knobs.
fn chunks(knobs: &str) -> Config {
    config(&format!("own; think-ms 200; control-hz 5; {knobs}"))
}

/// The recording of `config`, at run time `at` (s).
fn played(config: &Config, at: f64) -> App {
    let mut app = App::for_recording(Arc::new(recorded(setup(), config, 0.0)), setup());
    app.jump(seconds(at));
    sample(&mut app);
    until(&mut app, |app| !frame(app).awaits_limits);
    app
}

fn plan(app: &App) -> PlanData {
    frame(app).plan.expect("a plan")
}

#[test]
fn a_plan_lies_under_what_was_played() {
    let app = played(&chunks("chunk 50; plan committed"), 0.93);
    insta::assert_snapshot!("plan_80x24", small(&app));
    insta::assert_snapshot!("plan_160x50", large(&app));
    insta::assert_snapshot!("plan_ascii", drawn(&app, &POOR, 80, 24).to_string());
}

#[test]
fn a_plan_that_knows_what_is_played_meanwhile_means_just_that() {
    for (kind, meant) in [("committed", true), ("rollout", false)] {
        // The second chunk was taken at 0.42 s.
        let plan = plan(&played(&chunks(&format!("chunk 50; plan {kind}")), 0.45));
        assert_eq!((plan.kind, plan.taken, plan.stalls), (kind, 10, 0));
        let before = (1..plan.taken).all(|place| plan.is_as_played(place));
        assert_eq!(before, meant, "{kind}: {plan:?}");
        assert!(plan.is_as_played(plan.now), "{kind}: {plan:?}");
        assert!(!plan.is_as_played(plan.now + 1), "it is still to come");
    }
}

#[test]
fn what_a_plan_predicted_of_the_age_does_not_count_against_the_limit() {
    for (kind, said) in [("committed", "✓ fresh enough"), ("rollout", "⚠ falls")] {
        let app = ended(chunks(&format!("chunk 50; plan {kind}")));
        let age = frame(&app).age.expect("an age");
        assert!(age.mean > 2 * age.limit().expect("a limit"), "{age:?}");
        shows(&small(&app), &["predicted = ", said]);
    }
}

#[test]
fn a_fall_by_plans_has_their_cure() {
    for [knobs, why] in rows(
        "
        chunk 50; plan rollout | the policy's rollout plans miss what is played meanwhile. \
            :set policy plan committed fixes it
        chunk 12; plan committed | it had no action, as plans have 12 and the next one came \
            after 21. :set policy chunk 30 fixes it
        chunk 12; plan rollout | the policy's rollout plans miss what is played meanwhile. \
            :set policy plan committed, too, fixes it
        chunk 50; merge ensemble:0.01; think-ms none; control-hz 50 | merge ensemble:0.01 \
            averages old plans. :set player merge newest fixes it
        chunk 50; merge ensemble:0.01 | averages old plans. :set player merge newest takes 48 of \
            343 ms away the policy's rollout plans miss what is played meanwhile. :set policy \
            plan committed, too, fixes it
        chunk 50; plan committed; expect-delay 60 | it expected a delay of 60 ms, not 200 ms. \
            :set policy expect-delay 200 fixes it
        chunk 50; plan committed; expect-delay last; think-ms 300; control-hz 3 | it expected a \
            delay of 0 ms, not 300 ms. :set policy expect-delay 300 fixes it
        chunk 50; plan committed; model length:1.2 | its model of the plant is length:1.2. :set \
            policy model length:1 fixes it
        chunk 50; plan committed; play arrival | play arrival plays late what was meant for now. \
            :set player play time fixes it
        chunk 50; plan committed; disturb 3 | the plant is disturbed: at random, by 3 N. :set \
            actuator disturb 0 fixes it
        disturb 20; think-ms none; control-hz 50 | the plant is disturbed: at random, by 20 N. \
            :set actuator disturb 0 fixes it
        chunk 50; crash policy | the policy crashed",
    ) {
        let mut app = ended(chunks(&knobs));
        until(&mut app, |app| !frame(app).awaits_limits);
        let told = format!("{knobs}: {}", verdict(&app));
        shows(&told, &["FELL", &why]);
    }
}

#[test]
fn a_setting_of_a_whole_run_counts_from_the_next_one() {
    let mut app = session(endless("think-ms 200; control-hz 5; chunk 50"));
    sample(&mut app);
    for (typed, name, value) in [
        ("set policy chunk 30", "chunk", "30"),
        ("set policy model length:1.2", "model", "length:1.2"),
    ] {
        press(&mut app, &format!(":{typed}\n"));
        let short = &typed[typed.find(name).expect("the name")..];
        let told = format!("a run keeps it: {short} is used from the next run on: r starts it");
        assert_eq!(said(&app), told);
        assert_eq!(app.wanted().setup.parameter("policy", name), Some(value));
    }
    press(&mut app, ":set policy chunk 0\n");
    let refused = app.prompt.refusal().expect("a refusal");
    assert!(refused.contains("1 to 1000 actions"), "{refused}");
    press(&mut app, "\u{1b}r");
    sample(&mut app);
    let actions = |app: &App| frame(app).plan.map(|plan| plan.actions.len());
    until(&mut app, |app| actions(app) == Some(30));
    leave(app);
}

#[test]
fn the_timeline_has_plans_as_bars_with_the_part_that_was_played() {
    let mut app = played(&chunks("chunk 50; plan committed"), 0.93);
    press(&mut app, "6zVVV");
    sample(&mut app);
    insta::assert_snapshot!("plans_on_the_timeline_80x24", small(&app));
    let ascii = drawn(&app, &POOR, 80, 24).to_string();
    insta::assert_snapshot!("plans_on_the_timeline_ascii", ascii);
    let mut app = played(&chunks("chunk none; think-ms none"), 0.93);
    press(&mut app, "6z");
    sample(&mut app);
    assert!(!small(&app).contains("played"), "no plans");
}

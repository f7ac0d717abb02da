//! Plans under what was played of them.

use super::*;

/// A run whose policy thinks for 200 ms about each chunk of 50 actions, with more knobs.
fn chunks(knobs: &str, seconds_: f64) -> Config {
    let setup = format!("chunk 50, think-ms 200, control-hz 5, {knobs}");
    Config {
        world: WorldKind::OWN,
        end: seconds(seconds_),
        ..CartPole::config(&setup).expect("knobs")
    }
}

/// The newest plan of the last frame.
fn plan(app: &App) -> crate::frame::PlanData {
    frame(app).plan.expect("a plan")
}

#[test]
fn a_plan_lies_under_what_was_played() {
    let app = ended(chunks("plan committed", 4.13));
    insta::assert_snapshot!("plan_80x24", small(&app));
    insta::assert_snapshot!("plan_160x50", large(&app));
    insta::assert_snapshot!("plan_ascii", drawn(&app, &POOR, 80, 24).to_string());
}

//! Rescues, and sessions that only resemble them.

use std::sync::Arc;

use exercises::rescue::judge::{DANGER_DEG, HELD, RescueFailure, RescueSession, Rescued, judge};
use ratelab::{Hz, Message, Time};
use ratelab_cart_pole::{BROKEN_HZ, CONTROL_HZ, CartPole, ControlStep, STATE};
use ratelab_study::experiment::{Config, Experiment, Summary};

/// A session on the virtual clock, from the start of seed 0.
struct PlayedRun {
    summary: Summary,
    steps: Vec<Message<ControlStep>>,
}

/// Runs for `seconds`, with these changes of knobs.
fn run(seconds: f64, knobs: &[impl AsRef<str>]) -> PlayedRun {
    let knobs: Vec<&str> = knobs.iter().map(AsRef::as_ref).collect();
    let knobs = CartPole::KNOBS.parse_list(&knobs.join("\n"));
    let config = Config {
        end: Time::from_secs_f64(seconds).expect("time"),
        knobs: knobs.expect("knobs"),
        ..Config::default()
    };
    let experiment = Experiment::new(Arc::new(CartPole::default()), &config).expect("experiment");
    let tap = experiment.taps().messages(STATE, 10_000).expect(STATE);
    let summary = experiment.run().expect("run");
    let steps = tap.items().iter().map(|step| step.message).collect();
    PlayedRun { summary, steps }
}

impl PlayedRun {
    fn session(&self) -> RescueSession<'_> {
        RescueSession {
            control_hz: Hz::new(CONTROL_HZ).expect("a rate"),
            events: &self.summary.events,
            steps: &self.steps,
            verdict: self.summary.verdict,
        }
    }
}

fn judged(seconds: f64, knobs: &[&str]) -> Result<Rescued, RescueFailure> {
    judge(&run(seconds, knobs).session())
}

#[test]
fn a_pole_that_was_lost_and_caught_is_rescued() {
    let rescued = judged(10.0, &["0 control-hz 5", "0.3 control-hz 50"]).expect("rescued");
    assert_eq!(rescued.slowed, Time::ZERO);
    assert_eq!(rescued.slow_phase.as_millis(), 300);
    assert!(rescued.worst_deg > DANGER_DEG && rescued.worst_deg < 12.0);
    assert!(rescued.safe < Time::from_nanos(2_000_000_000));
}

/// Knobs at their times, each as `time control-hz`.
fn changes(knobs: &str) -> Vec<String> {
    let knobs = knobs.split(", ").filter(|knob| !knob.is_empty());
    knobs
        .map(|knob| knob.replace(' ', " control-hz "))
        .collect()
}

#[test]
fn what_is_a_rescue_and_what_only_resembles_one() {
    // The seconds of a run, its changes of the control rate, and the part that is missing.
    for (what, seconds, knobs, missing) in [
        ("in steps", 10.0, "0 10, 0 4, 0.2 9, 0.3 50", ""),
        ("later in a run", 10.0, "1 5, 2.1 50", ""),
        ("at a second try", 10.0, "0 5, 0.1 50, 1 5, 2.16 50", ""),
        ("never slow", 10.0, "", "Slowness"),
        ("not slow enough", 20.0, "0 5.1, 0.3 50", "Slowness"),
        // The pole swings into danger and stays up.
        ("in danger without it", 20.0, "0 8", "Slowness"),
        ("never in danger", 10.0, "0 5, 0.1 50", "Danger"),
        ("fell at once", 10.0, "0 5", "Survival"),
        ("too late", 10.0, "0 5, 0.8 50", "Survival"),
        ("before it was safe", 10.0, "0 5, 0.2 50, 1 5", "Survival"),
        ("still slow", 0.5, "0 5", "Return"),
        ("still swings", 12.0, "0 5, 0.3 8", "Calm"),
    ] {
        let run = run(seconds, &changes(knobs));
        let found = judge(&run.session());
        let failure = found
            .err()
            .map_or(String::new(), |failure| format!("{failure:?}"));
        let kind = failure.split(' ').next();
        assert_eq!(kind, Some(missing), "{what}: {failure}");
        match found {
            Err(RescueFailure::Survival { at }) => assert_eq!(at, run.summary.sim_time, "{what}"),
            Err(RescueFailure::Danger { worst_deg }) => assert!(worst_deg < DANGER_DEG, "{what}"),
            _ => {}
        }
    }
}

#[test]
fn danger_long_after_a_slow_phase_is_not_its_effect() {
    let run = run(20.0, &changes("0 5, 0.1 50, 2 8, 9 50"));
    let angles = run.steps.iter().map(|step| step.data.qpos[1].abs());
    let widest = angles.fold(0.0, f64::max).to_degrees();
    assert!(widest > DANGER_DEG, "it was in danger");
    let failure = judge(&run.session());
    assert!(matches!(failure, Err(RescueFailure::Danger { .. })));
}

#[test]
fn a_rescue_stays_valid_after_later_events() {
    let run = run(20.0, &changes("0 5, 0.3 50, 8 5"));
    assert!(run.summary.verdict.is_lost());
    assert!(judge(&run.session()).is_ok());
}

#[test]
fn five_seconds_out_of_danger_are_enough() {
    let knobs = ["0 control-hz 5", "0.3 control-hz 50"];
    let safe = judged(10.0, &knobs).expect("rescued").safe.as_secs_f64();
    assert!(judged(safe + 5.0, &knobs).is_ok());
    let failure = judged(safe + 4.9, &knobs).expect_err("too soon");
    assert!(matches!(failure, RescueFailure::Calm { .. }), "{failure:?}");
}

#[test]
fn a_record_with_missing_steps_proves_nothing() {
    let mut run = run(10.0, &["0 control-hz 5", "0.3 control-hz 50"]);
    run.steps.remove(100);
    assert_eq!(judge(&run.session()), Err(RescueFailure::Steps));
    run.steps.clear();
    assert!(matches!(
        judge(&run.session()),
        Err(RescueFailure::Danger { .. })
    ));
}

#[test]
fn the_objective_names_the_figures_of_the_judgement() {
    let objective = &exercises::find(5).expect("the rescue").brief().objective;
    let slow = format!("to {BROKEN_HZ} Hz or less");
    for figure in [
        slow,
        format!("beyond {DANGER_DEG}°"),
        format!("within {DANGER_DEG}°"),
    ] {
        assert!(objective.contains(&figure), "{figure}");
    }
    assert!(objective.contains("for five seconds") && HELD.as_secs() == 5);
}

#[test]
fn a_failure_names_the_missing_part_and_a_remedy() {
    let said = judged(10.0, &["0 control-hz 5"])
        .expect_err("it fell")
        .to_string();
    assert_eq!(said, "it fell at 0.840 s: speed the policy up sooner");
    let said = judged(10.0, &[]).expect_err("never slow").to_string();
    assert_eq!(said, "the policy was never slowed to 5 Hz or less");
}

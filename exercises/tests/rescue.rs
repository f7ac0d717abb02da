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
fn run(seconds: f64, knobs: &[&str]) -> PlayedRun {
    let config = Config {
        end: Time::from_secs_f64(seconds).expect("time"),
        knobs: CartPole::KNOBS
            .parse_list(&knobs.join("\n"))
            .expect("knobs"),
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

#[test]
fn a_rescue_may_go_down_and_up_in_steps() {
    let knobs = [
        "0 control-hz 10",
        "0 control-hz 4",
        "0.2 control-hz 9",
        "0.3 control-hz 50",
    ];
    assert!(judged(10.0, &knobs).is_ok());
}

#[test]
fn later_in_a_run_it_is_a_rescue_too() {
    assert!(judged(10.0, &["1 control-hz 5", "2.1 control-hz 50"]).is_ok());
}

#[test]
fn without_a_slow_phase_there_is_no_rescue() {
    assert_eq!(judged(10.0, &[]), Err(RescueFailure::Slowness));
    assert_eq!(
        judged(20.0, &["0 control-hz 5.1", "0.3 control-hz 50"]),
        Err(RescueFailure::Slowness)
    );
    // The pole swings into danger and stays up, but the policy was never slowed to 5 Hz.
    assert_eq!(
        judged(20.0, &["0 control-hz 8"]),
        Err(RescueFailure::Slowness)
    );
}

#[test]
fn a_pole_that_was_never_in_danger_was_not_rescued() {
    let failure = judged(10.0, &["0 control-hz 5", "0.1 control-hz 50"]);
    let Err(RescueFailure::Danger { worst_deg }) = failure else {
        panic!("{failure:?}");
    };
    assert!(worst_deg < DANGER_DEG);
}

#[test]
fn danger_long_after_a_slow_phase_is_not_its_effect() {
    let knobs = [
        "0 control-hz 5",
        "0.1 control-hz 50",
        "2 control-hz 8",
        "9 control-hz 50",
    ];
    let run = run(20.0, &knobs);
    let widest = run
        .steps
        .iter()
        .map(|step| step.data.qpos[1].abs().to_degrees());
    assert!(widest.fold(0.0, f64::max) > DANGER_DEG, "it was in danger");
    assert!(matches!(
        judge(&run.session()),
        Err(RescueFailure::Danger { .. })
    ));
}

#[test]
fn a_pole_that_fell_was_not_rescued() {
    for knobs in [
        &["0 control-hz 5"][..],
        &["0 control-hz 5", "0.8 control-hz 50"],
        &["0 control-hz 5", "0.2 control-hz 50", "1 control-hz 5"],
    ] {
        let run = run(10.0, knobs);
        let failure = judge(&run.session()).expect_err("it fell");
        assert_eq!(
            failure,
            RescueFailure::Survival {
                at: run.summary.sim_time
            }
        );
    }
}

#[test]
fn a_pole_with_a_slow_policy_is_not_rescued_yet() {
    let knobs = ["0 control-hz 5"];
    assert_eq!(judged(0.5, &knobs), Err(RescueFailure::Return));
}

#[test]
fn five_seconds_out_of_danger_are_enough() {
    let knobs = ["0 control-hz 5", "0.3 control-hz 50"];
    let safe = judged(10.0, &knobs).expect("rescued").safe.as_secs_f64();
    assert!(judged(safe + 5.0, &knobs).is_ok());
    let failure = judged(safe + 4.9, &knobs);
    assert!(
        matches!(failure, Err(RescueFailure::Calm { .. })),
        "{failure:?}"
    );
}

#[test]
fn a_continuing_swing_is_no_rescue() {
    let failure = judged(12.0, &["0 control-hz 5", "0.3 control-hz 8"]);
    assert!(
        matches!(failure, Err(RescueFailure::Calm { .. })),
        "{failure:?}"
    );
}

#[test]
fn a_rescue_stays_valid_after_later_events() {
    let knobs = ["0 control-hz 5", "0.3 control-hz 50", "8 control-hz 5"];
    let run = run(20.0, &knobs);
    assert!(run.summary.verdict.is_lost());
    assert!(judge(&run.session()).is_ok());
}

#[test]
fn a_second_try_counts_as_much_as_the_first() {
    let knobs = [
        "0 control-hz 5",
        "0.1 control-hz 50",
        "1 control-hz 5",
        "2.16 control-hz 50",
    ];
    assert!(judged(10.0, &knobs).is_ok());
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
    let objective = exercises::find(5).expect("the rescue").brief().objective;
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

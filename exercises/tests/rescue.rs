//! Rescues, and sessions that only resemble them.

#[path = "../../tests/support/table.rs"]
mod table;

use std::sync::Arc;

use exercises::rescue::judge::{DANGER_DEG, HELD, RescueFailure, RescueSession, Rescued, judge};
use ratelab::{Hz, Message, Time};
use ratelab_cart_pole::{BROKEN_HZ, CONTROL_HZ, CartPole, ControlStep, STATE};
use ratelab_experiment::{Config, Experiment, Summary};
use table::rows;

/// A session on the virtual clock, from the start of seed 0.
struct PlayedRun {
    summary: Summary,
    steps: Vec<Message<ControlStep>>,
}

/// Runs for `seconds`, with the control rate changed at times (s), such as `0 5, 0.3 50`.
fn run(seconds: f64, rates: &str) -> PlayedRun {
    let rates = rates.split(", ").filter(|rate| !rate.is_empty());
    let knobs: Vec<_> = rates
        .map(|rate| rate.replace(' ', " control-hz "))
        .collect();
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
    fn judged(&self) -> Result<Rescued, RescueFailure> {
        judge(&RescueSession {
            control_hz: Hz::new(CONTROL_HZ).expect("a rate"),
            events: &self.summary.events,
            steps: &self.steps,
            verdict: self.summary.verdict.clone(),
        })
    }

    /// What became of the pole in the whole run.
    fn pole(&self) -> &str {
        let angles = self.steps.iter().map(|step| step.data.qpos[1].abs());
        let widest = angles.fold(0.0, f64::max).to_degrees();
        if self.summary.verdict.is_lost() {
            "fell"
        } else if widest > DANGER_DEG {
            "in danger"
        } else {
            "safe"
        }
    }
}

/// The policy slowed down, and speeded up before the pole falls.
const RESCUE: &str = "0 5, 0.3 50";

#[test]
fn a_pole_that_was_lost_and_caught_is_rescued() {
    let rescued = run(10.0, RESCUE).judged().expect("rescued");
    assert_eq!(rescued.slowed, Time::ZERO);
    assert_eq!(rescued.slow_phase.as_millis(), 300);
    assert!(rescued.worst_deg > DANGER_DEG && rescued.worst_deg < 12.0);
    assert!(rescued.safe < Time::from_nanos(2_000_000_000));
    // Five seconds out of danger are enough.
    let safe = rescued.safe.as_secs_f64();
    assert!(run(safe + 5.0, RESCUE).judged().is_ok());
    let failure = run(safe + 4.9, RESCUE).judged().expect_err("too soon");
    assert!(matches!(failure, RescueFailure::Calm { .. }), "{failure:?}");
}

#[test]
fn what_is_a_rescue_and_what_only_resembles_one() {
    // The seconds of a run, its changes of the control rate, the pole, and the part that is missing.
    for [what, seconds, rates, pole, missing] in rows(
        "in steps             | 10  | 0 10, 0 4, 0.2 9, 0.3 50  | in danger |
         later in a run       | 10  | 1 5, 2.1 50               | in danger |
         at a second try      | 10  | 0 5, 0.1 50, 1 5, 2.16 50 | in danger |
         and lost later       | 20  | 0 5, 0.3 50, 8 5          | fell      |
         never slow           | 10  |                           | safe      | Slowness
         not slow enough      | 20  | 0 5.1, 0.3 50             | in danger | Slowness
         in danger without it | 20  | 0 8                       | in danger | Slowness
         never in danger      | 10  | 0 5, 0.1 50               | safe      | Danger
         danger long after    | 20  | 0 5, 0.1 50, 2 8, 9 50    | in danger | Danger
         on the way across    | 10  | 0 5, 0.4 50               | in danger | Recovered
         back by itself       | 10  | 0 5, 0.6 50               | in danger | Recovered
         a moment too late    | 10  | 0 5, 0.7 50               | in danger | Recovered
         just in time         | 10  | 0 5, 0.5 50               | in danger |
         fell at once         | 10  | 0 5                       | fell      | Survival
         too late             | 10  | 0 5, 0.8 50               | fell      | Survival
         before it was safe   | 10  | 0 5, 0.2 50, 1 5          | fell      | Survival
         still slow           | 0.5 | 0 5                       | in danger | Return
         still swings         | 12  | 0 5, 0.3 8                | in danger | Calm",
    ) {
        let run = run(seconds.parse().expect("seconds"), &rates);
        let found = run.judged();
        let failure = found.as_ref().err();
        let failure = failure.map_or(String::new(), |failure| format!("{failure:?}"));
        let kind = failure.split(' ').next();
        assert_eq!(kind, Some(&*missing), "{what}: {failure}");
        assert_eq!(run.pole(), pole, "{what}");
        match found {
            Err(RescueFailure::Survival { at }) => assert_eq!(at, run.summary.sim_time, "{what}"),
            Err(RescueFailure::Danger { worst_deg }) => {
                assert_eq!(worst_deg > DANGER_DEG, pole == "in danger", "{what}");
            }
            _ => {}
        }
    }
}

#[test]
fn a_record_with_missing_steps_proves_nothing() {
    let mut run = run(10.0, RESCUE);
    run.steps.remove(100);
    assert_eq!(run.judged(), Err(RescueFailure::Steps));
    run.steps.clear();
    assert!(matches!(run.judged(), Err(RescueFailure::Danger { .. })));
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
    for (rates, said) in [
        ("0 5", "it fell at 0.840 s: speed the policy up sooner"),
        ("", "the policy was never slowed to 5 Hz or less"),
    ] {
        let failure = run(10.0, rates).judged().expect_err(said);
        assert_eq!(failure.to_string(), said);
    }
}

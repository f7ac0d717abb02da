//! How a run ended is told as it was: a cart that leaves the rail is not a pole
//! that fell.

use ratelab::{
    cartpole::{Action, CART_LIMIT_M, Observation, POLE_LIMIT_RAD},
    experiment::{Config, Experiment, Summary, Verdict},
    policy::{Policy, PolicyKind},
    runtime::Time,
};

/// Balances the pole about an angle (rad) instead of upright, which takes the
/// cart along faster and faster.
struct Lean(f64);

impl Policy for Lean {
    fn name(&self) -> &str {
        "lean"
    }

    fn act(&mut self, seen: &Observation) -> Action {
        let theta = f64::from(seen.sin_theta).atan2(f64::from(seen.cos_theta));
        Action((10.0 * (theta - self.0) + 2.0 * f64::from(seen.pole_velocity)) as f32)
    }
}

fn run(config: &Config, policy: Box<dyn Policy>) -> Summary {
    let experiment = Experiment::with_policy(config, policy).expect("experiment");
    experiment.run().expect("run")
}

#[test]
fn a_cart_that_leaves_the_rail_with_the_pole_up_is_told_as_such() {
    let summary = run(&Config::default(), Box::new(Lean(0.05)));
    let Verdict::CartLeftRail { at } = summary.verdict else {
        panic!("{}", summary.verdict);
    };
    assert_eq!(at, summary.sim_time);
    assert!(summary.final_pole_angle.abs() < POLE_LIMIT_RAD);
    assert!(!summary.verdict.balanced());
    let said = summary.verdict.to_string();
    assert!(
        said.contains(&CART_LIMIT_M.to_string()) && !said.contains("FELL"),
        "{said}"
    );
}

#[test]
fn an_unattended_pole_falls() {
    for kind in [PolicyKind::Zero, PolicyKind::Random] {
        let config = Config {
            policy: kind.into(),
            ..Config::default()
        };
        let experiment = Experiment::new(&config).expect("experiment");
        let summary = experiment.run().expect("run");
        assert!(
            matches!(summary.verdict, Verdict::PoleFell { .. }),
            "{kind}: {}",
            summary.verdict
        );
    }
}

#[test]
fn the_last_instant_belongs_to_the_run() {
    let config = Config {
        end: Time::from_nanos(1_000_000_000),
        ..Config::default()
    };
    let summary = Experiment::new(&config).expect("experiment");
    let summary = summary.run().expect("run");
    assert_eq!(summary.verdict, Verdict::Balanced);
    assert_eq!((summary.steps, summary.sim_time), (51, config.end));
}

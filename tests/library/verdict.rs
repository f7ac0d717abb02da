//! The verdict names the kind of loss: a cart that leaves the rail differs from a fall of
//! the pole.

use ratelab::Time;
use ratelab_cart_pole::{
    Action, CART_LIMIT_M, Observation, POLE_LIMIT_RAD, pole_angle,
    policy::{Policy, PolicyKind},
    verdict,
};
use ratelab_study::experiment::{Config, Experiment};

use crate::support::{config, run, with_policy};

/// Balances the pole at an angle (rad) away from upright, which accelerates the cart.
#[derive(Clone)]
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

#[test]
fn a_cart_that_leaves_the_rail_with_the_pole_up_is_not_a_pole_that_fell() {
    let leaning = Experiment::new(with_policy(Lean(0.05)), &Config::default());
    let summary = leaning.expect("experiment").run().expect("run");
    assert_eq!(*summary.verdict.kind, verdict::CART_LEFT_RAIL);
    assert_eq!(summary.verdict.at, summary.sim_time);
    assert!(pole_angle(&summary.state).abs() < POLE_LIMIT_RAD);
    assert!(summary.verdict.is_lost());
    let printed = summary.verdict.to_string();
    assert!(
        printed.contains(&CART_LIMIT_M.to_string()) && !printed.contains("FELL"),
        "{printed}"
    );
}

#[test]
fn an_unattended_pole_falls() {
    for kind in [PolicyKind::Zero, PolicyKind::Random] {
        let summary = run(&config(&format!("policy {kind}")));
        assert_eq!(*summary.verdict.kind, verdict::POLE_FELL, "{kind}");
    }
}

#[test]
fn the_last_instant_belongs_to_the_run() {
    let config = Config {
        end: Time::from_nanos(1_000_000_000),
        ..Config::default()
    };
    let summary = run(&config);
    assert_eq!(*summary.verdict.kind, verdict::BALANCED);
    assert_eq!((summary.steps, summary.sim_time), (51, config.end));
}

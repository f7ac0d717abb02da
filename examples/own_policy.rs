//! A policy of your own: full force to the side where the pole falls and the cart rolls.
//!
//! A policy receives an observation and returns an action. It runs in the policy node,
//! without a change to sensor and actuator.

use std::{error::Error, sync::Arc};

use ratelab_cart_pole::{Action, CartPole, Observation, pole_angle, policy::Policy};
use ratelab_experiment::Experiment;

/// Pushes with full force to where the pole will be in a quarter of a second, with a
/// little of the cart's speed added: that leans the pole against the motion of the cart,
/// which brings the cart back.
struct BangBang;

impl Policy for BangBang {
    fn name(&self) -> &str {
        "bang-bang"
    }

    fn act(&mut self, seen: &Observation) -> Action {
        let angle = seen.sin_theta.atan2(seen.cos_theta);
        let soon = angle + 0.25 * seen.pole_velocity + 0.1 * seen.cart_velocity;
        Action(soon.signum())
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let system = Arc::new(CartPole::with_policy(|_| Box::new(BangBang)));
    for hz in [50, 25, 10, 5] {
        let config = CartPole::config(&format!("control-hz {hz}"))?;
        let summary = Experiment::new(system.clone(), &config)?.run()?;
        let angle = pole_angle(&summary.state).to_degrees();
        println!("{hz} Hz: {}, at {angle:.1}° in the end", summary.verdict);
    }
    Ok(())
}

//! A policy of your own: all the force there is, to the side the pole falls to,
//! and to which the cart rolls.
//!
//! A policy sees an observation and answers with an action. It is put behind the
//! policy node, and sensor and actuator never notice.

use std::{error::Error, sync::Arc};

use ratelab::{
    cartpole::{Action, CartPole, Observation, pole_angle},
    experiment::Experiment,
    policy::Policy,
};

/// Pushes with all it has to where the pole will be in a quarter of a second, with
/// a little of the cart's speed added: that leans the pole against the way the cart
/// rolls, which brings it back.
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

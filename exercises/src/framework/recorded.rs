//! Runs of the cart-pole.

use std::sync::Arc;

use ratelab::Message;
use ratelab_cart_pole::{CONTROL_HZ, CartPole, ControlStep, STATE};
use ratelab_study::{
    experiment::{Config, Experiment, Summary, sweep::SweepAxis},
    system::WorldKind,
};

use super::Failure;

/// The cart-pole.
pub(crate) fn cart_pole() -> Arc<CartPole> {
    Arc::default()
}

/// Ten seconds in the world that does not wait, with the knobs in `setup`.
pub(crate) fn own_world(setup: &str) -> Result<Config, Failure> {
    Ok(Config {
        world: WorldKind::OWN,
        ..CartPole::config(setup)?
    })
}

/// A knob of the cart-pole with its values in a sweep.
pub(crate) fn axis<T: ToString>(name: &str, values: &[T]) -> Result<SweepAxis, Failure> {
    let values = values.iter().map(T::to_string);
    Ok(SweepAxis::of(CartPole::KNOBS, name, values)?)
}

/// A run and its control steps.
pub(crate) struct RecordedRun {
    pub(crate) summary: Summary,
    pub(crate) steps: Vec<Message<ControlStep>>,
}

/// Runs `config`, which must have an end, and records every control step.
pub(crate) fn record(config: &Config) -> Result<RecordedRun, Failure> {
    let experiment = Experiment::new(cart_pole(), config)?;
    // Enough capacity for all steps, so that the run never waits.
    let room = (config.end.as_secs_f64() * CONTROL_HZ) as usize + 2;
    let tap = experiment.taps().messages(STATE, room);
    let tap = tap.ok_or_else(|| Failure::Unmeasured(format!("{STATE} is not recorded")))?;
    let summary = experiment.run()?;
    let steps = tap.items().iter().map(|step| step.message).collect();
    Ok(RecordedRun { summary, steps })
}

//! A run with every control step that it made.

use ratelab::{
    cartpole::{CONTROL_HZ, ControlStep},
    experiment::{Config, Experiment, Summary},
    runtime::Message,
};

use super::Failure;

/// A run and its control steps.
pub(crate) struct Recorded {
    pub(crate) summary: Summary,
    pub(crate) steps: Vec<Message<ControlStep>>,
}

/// Runs `config`, which must have an end, and keeps every control step.
pub(crate) fn record(config: &Config) -> Result<Recorded, Failure> {
    let experiment = Experiment::new(config)?;
    // Room for all of them, so that the run never waits for a reader.
    let room = (config.end.as_secs_f64() * CONTROL_HZ) as usize + 2;
    let tap = experiment.taps().steps(room);
    let summary = experiment.run()?;
    let steps = tap.items().iter().map(|step| step.message).collect();
    Ok(Recorded { summary, steps })
}

//! Runs of the cart-pole: one that is recorded, and one knob with several values.

use std::{fmt, ops::ControlFlow, sync::Arc};

use ratelab::{Hz, Message};
use ratelab_cart_pole::{
    CONTROL_HZ, CartPole, ControlStep, STATE,
    policy::Scripted,
    stability::{Loop, Timing, WorldModel},
};
use ratelab_experiment::{
    Config, Experiment, Summary,
    sweep::{CellResult, Sweep, SweepAxis, all_cores},
};
use ratelab_system::{KnobText, System, WorldKind};

use super::{Failure, Measurement, mean_ms};

/// Returns the cart-pole.
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

/// Returns the loop of the scripted policy at 50 Hz in that world, for theory.
pub(crate) fn control_loop() -> Result<Loop, Failure> {
    let timing = Timing::direct(Hz::new(CONTROL_HZ)?);
    let model = WorldModel::Continuous;
    Ok(Loop::cart_pole(Scripted::GAINS, model, timing)?)
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
    let tap = experiment
        .taps()
        .messages(STATE, room)
        .ok_or_else(|| Failure::Unmeasured(format!("{STATE} is not recorded")))?;
    let summary = experiment.run()?;
    let steps = tap.items().iter().map(|step| step.message).collect();
    Ok(RecordedRun { summary, steps })
}

/// Returns the angle of the pole from upright after `step` (degrees).
pub(crate) fn angle_deg(step: &Message<ControlStep>) -> f64 {
    step.data.qpos[1].abs().to_degrees()
}

/// Returns the widest angle of the pole in `steps` (degrees).
pub(crate) fn widest_deg<'s>(steps: impl IntoIterator<Item = &'s Message<ControlStep>>) -> f64 {
    steps.into_iter().map(angle_deg).fold(0.0, f64::max)
}

/// The runs with one value of a knob.
pub(crate) struct KnobRuns {
    /// The value.
    pub(crate) value: String,
    /// The results, by start.
    pub(crate) runs: Vec<CellResult>,
}

impl KnobRuns {
    /// Returns the value, if it is a number.
    pub(crate) fn number(&self) -> f64 {
        self.value.parse().unwrap_or(f64::NAN)
    }

    /// Returns the number of runs with the pole up at the end.
    pub(crate) fn up(&self) -> usize {
        self.runs
            .iter()
            .filter(|run| !run.verdict.is_lost())
            .count()
    }

    /// Returns whether the pole was up at the end of all runs.
    pub(crate) fn all_up(&self) -> bool {
        self.up() == self.runs.len()
    }

    /// Such as `3 of 20`.
    pub(crate) fn up_of(&self) -> String {
        format!("{} of {}", self.up(), self.runs.len())
    }

    /// Returns the mean push age of the last second (ms), over all runs; NaN without one.
    pub(crate) fn push_age_ms(&self) -> f64 {
        let ages: Vec<f64> = self
            .runs
            .iter()
            .filter_map(|run| run.push_age)
            .map(|age| mean_ms(Some(age.late_s)))
            .collect();
        ages.iter().sum::<f64>() / ages.len() as f64
    }

    /// Such as `34.0 ms`.
    pub(crate) fn push_age(&self) -> String {
        format!("{:.1} ms", self.push_age_ms())
    }

    /// Returns the starts of `subject` that stayed up, as a figure.
    pub(crate) fn balanced(&self, subject: impl fmt::Display) -> Measurement {
        Measurement::new(format!("{subject}: starts balanced"), self.up() as f64)
    }
}

/// Runs `base` with each of `values` of `knob`, from the starts of the first seeds.
pub(crate) fn survey<T: ToString, const VALUES: usize>(
    base: Config,
    knob: &str,
    values: [T; VALUES],
    starts: u64,
) -> Result<[KnobRuns; VALUES], Failure> {
    survey_of(cart_pole(), base, knob, values, starts)
}

/// Returns the same with another system.
pub(crate) fn survey_of<T: ToString, const VALUES: usize>(
    system: Arc<dyn System>,
    base: Config,
    knob: &str,
    values: [T; VALUES],
    starts: u64,
) -> Result<[KnobRuns; VALUES], Failure> {
    let texts = values.map(|value| value.to_string());
    let knobs = KnobText(system.knobs().aliases());
    let sweep = Sweep {
        axes: vec![SweepAxis::from_texts(knobs, knob, texts.clone())?],
        seeds: (0..starts).collect(),
        ..Sweep::new(system, base)
    };
    let swept = sweep.run(all_cores(), |_, _| ControlFlow::Continue(()))?;
    let mut runs = swept.finished().map(|(_, run)| run.clone());
    Ok(texts.map(|value| KnobRuns {
        value,
        runs: runs.by_ref().take(starts as usize).collect(),
    }))
}

/// Returns the messages of the first topic with a reader, `/obs`, that were dropped in a run.
pub(crate) fn obs_dropped(run: &CellResult) -> u64 {
    run.dropped.first().copied().unwrap_or_default()
}

/// Of trials in their order, the last that holds and the first that does not.
pub(crate) fn edge<T>(trials: &[T], holds: impl Fn(&T) -> bool) -> Result<(&T, &T), Failure> {
    let edge = trials
        .iter()
        .zip(trials.iter().skip(1))
        .find(|(one, next)| holds(one) && !holds(next));
    edge.ok_or_else(|| Failure::Unmeasured("nothing held and then failed".to_owned()))
}

/// Of trials the one that the question asks about.
pub(crate) fn asked<T>(trials: &[T], is_asked: impl Fn(&&T) -> bool) -> Result<&T, Failure> {
    let asked = trials.iter().find(is_asked);
    asked.ok_or_else(|| Failure::Unmeasured("the run of the question is missing".to_owned()))
}

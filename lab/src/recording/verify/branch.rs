//! Leaves a recorded run at a moment, and goes on under the virtual clock with something
//! changed.

use std::{sync::Arc, time::Duration};

use ratelab::{
    experiment::{Config, Experiment, Summary},
    runtime::{Command, Fault, Knob, Rerun, Time, TimedCommand, TimedKnob, telemetry::Event},
    system::System,
};

use super::{VerifyError, again, events, order};
use crate::recording::reader::Recording;

/// Run time of a branch of an endless run.
const BRANCH: Duration = Duration::from_secs(10);

/// A branch of a recorded run.
pub struct Branch {
    /// Run time at which it left the recorded run.
    pub at: Time,
    /// Its result.
    pub result: Result<Summary, Fault>,
}

/// Runs `recording` of `system` again up to run time `at`, or to the last rest of its nodes
/// before; there it turns `knobs`, and goes on under the virtual clock until `end`. Knobs
/// that were turned later in the recorded run are turned again.
///
/// # Errors
/// [`VerifyError`] if the run cannot be executed again, or does not have the knobs.
pub fn branch(
    recording: &Recording,
    system: &Arc<dyn System>,
    at: Time,
    knobs: &[Knob],
    end: Option<Time>,
) -> Result<Branch, VerifyError> {
    super::refuse_other_system(recording, system)?;
    let mut rerun = order::rerun(recording, &**system)?;
    let timed = knobs.iter().cloned().map(|knob| TimedKnob { at, knob });
    let config = again::with_tables(Config {
        knobs: timed.collect(),
        end: end.unwrap_or_else(|| end_of(recording, at)),
        ..again::config_again(recording, None)
    })?;
    let turned: Vec<TimedKnob> = recording.events.iter().filter_map(Event::knob).collect();
    let taken = again::taken(&config, turned);
    let timed = Experiment::again(system.clone(), &config, &taken)?;
    let clock = recording.origin.config.clock;
    let rest = rerun
        .as_ref()
        .and_then(|rerun| rerun.rest_before(at, clock));
    let mut experiment = match (&mut rerun, rest) {
        (Some(rerun), Some(_)) => {
            let knobs = timed.config().knobs.iter();
            rerun.branch(at, knobs.map(|timed| timed.knob.clone().into()).collect());
            let knobs = Vec::new();
            Experiment::again(system.clone(), &Config { knobs, ..config }, &taken)?
        }
        _ => timed,
    };
    experiment.schedule(commands(recording, &**system, rerun.as_ref(), at)?);
    let result = match &mut rerun {
        Some(rerun) => experiment.run_with(rerun),
        None => experiment.run(),
    };
    if let Some(diverged) = rerun.as_ref().and_then(Rerun::difference) {
        return Err(VerifyError::Diverged(diverged));
    }
    let at = rest.unwrap_or(at);
    Ok(Branch { at, result })
}

/// The configured end, if the run has one.
fn end_of(recording: &Recording, at: Time) -> Time {
    match recording.origin.config.end {
        Time::MAX => recording.until.max(at + BRANCH),
        end => end,
    }
}

/// The commands of the virtual clock up to run time `at`, and all knobs of later.
fn commands(
    recording: &Recording,
    system: &dyn System,
    rerun: Option<&Rerun>,
    at: Time,
) -> Result<Vec<TimedCommand>, VerifyError> {
    let mut commands = events::commands(recording, system, rerun)?;
    commands.retain(|timed| timed.at <= at || matches!(timed.command, Command::Set(_)));
    let known = recording.events.iter().enumerate();
    let known = known.filter(|(index, _)| rerun.is_some_and(|rerun| rerun.knows(*index)));
    let later = known.filter_map(|(_, event)| event.knob().filter(|timed| timed.at > at));
    commands.extend(later.map(TimedCommand::from));
    commands.sort_by_key(|timed| timed.at);
    Ok(commands)
}

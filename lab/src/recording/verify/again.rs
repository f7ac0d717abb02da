//! The run that comes of a recording.

use std::{
    panic::resume_unwind,
    thread::{self, ScopedJoinHandle},
    time::Duration,
};

use ratelab::{
    experiment::{ACTION, Config, Experiment, OBS, RunEnd, STATE, SetupError, TimedKnob},
    policy::Shelf,
    runtime::{ClockKind, Fault, Speed, Time, telemetry::Event},
};

use super::{
    VerifyError,
    compare::Judge,
    difference::Difference,
    series::{Messages, Ticks},
};
use crate::recording::{
    reader::{Recording, Track},
    schema::{End, Outcome},
};

/// Run time that a run may go on after it ended when it was recorded, until that
/// is what is different.
const GRACE: Duration = Duration::from_secs(1);

/// Run time for which a run may say nothing: that of the slowest sensor there
/// can be.
const SILENCE: Duration = Duration::from_secs(1_000);

/// Messages or ticks that may wait to be compared.
const BACKLOG: usize = 1024;

/// Runs it again; what is different.
pub fn run_again(
    recording: &Recording,
    [observed, acted, stepped]: [Option<&Track>; 3],
) -> Result<Vec<Difference>, VerifyError> {
    let whole = recording
        .outcome
        .as_ref()
        .filter(|outcome| outcome.end != End::WentOn);
    let config = config_again(recording, whole);
    let turned = recording.events.iter().filter_map(TimedKnob::of);
    let turned: Vec<TimedKnob> = turned.collect();
    let swaps = turned.iter().filter_map(|timed| timed.knob.brain());
    // What cannot be had any more is said before anything is compared.
    let shelf = Shelf::of(config.brains().chain(swaps)).map_err(SetupError::from)?;
    let mut experiment = Experiment::with_shelf(&config, shelf)?;
    let commands = recording.events.iter().filter_map(Event::replayable);
    experiment.schedule(commands.collect());
    let taps = experiment.taps();
    let observations = taps.observations(BACKLOG);
    let actions = taps.actions(BACKLOG);
    let steps = taps.steps(BACKLOG);
    let ticks = ticks(recording).zip(taps.ticks(BACKLOG));
    // A tap that nobody empties would hold the run up for ever.
    let ticks: Vec<_> = ticks.collect();
    drop(taps);
    let judge = Judge::new(recording, whole.is_some(), experiment.commands());
    let (mut differences, outcome) = thread::scope(|scope| {
        let judge = &judge;
        let mut checks = vec![
            scope.spawn(move || judge.compare(&Messages::of(OBS, observed?), observations)),
            scope.spawn(move || judge.compare(&Messages::of(ACTION, acted?), actions)),
            scope.spawn(move || judge.compare(&Messages::of(STATE, stepped?), steps)),
        ];
        let ticks = ticks.into_iter();
        checks.extend(ticks.map(|(ticks, tap)| scope.spawn(move || judge.compare(&ticks, tap))));
        let outcome = experiment.run();
        let found = checks.into_iter().filter_map(found);
        (found.collect::<Vec<_>>(), outcome)
    });
    if differences.is_empty() {
        let ended = outcome.map(|summary| summary.end());
        differences.extend(whole.and_then(|outcome| compare_end(&outcome.end, outcome.at, &ended)));
    }
    Ok(differences)
}

/// What a comparison found. One that broke off found nothing, which must not pass
/// for no difference.
fn found(check: ScopedJoinHandle<Option<Difference>>) -> Option<Difference> {
    check.join().unwrap_or_else(|panic| resume_unwind(panic))
}

/// What to run: no longer than there is something to compare with, and what
/// ended early may not end at all now.
fn config_again(recording: &Recording, whole: Option<&Outcome>) -> Config {
    let given = &recording.origin.config;
    let messages = recording.topics.iter().filter_map(|t| t.heads.last());
    let ticks = recording.ticks.iter().filter_map(|ticks| ticks.last());
    let stamps = messages.map(|head| head.stamp);
    let last = stamps.chain(ticks.map(|tick| tick.at)).max();
    let last = last.unwrap_or(Time::ZERO);
    Config {
        clock: ClockKind::Virtual,
        speed: Speed::FlatOut,
        think: Duration::ZERO,
        knobs: Vec::new(),
        end: match whole {
            Some(outcome) => given.end.min(outcome.at.min(last + SILENCE) + GRACE),
            None => recording.until.min(last),
        },
        ..given.clone()
    }
}

/// The ticks that were recorded, a series per node.
fn ticks(recording: &Recording) -> impl Iterator<Item = Ticks<'_>> {
    let nodes = recording.origin.shape.nodes.iter();
    nodes.zip(&recording.ticks).map(|(node, ticks)| Ticks {
        node: &node.name,
        ticks,
    })
}

/// Compares how the run ended.
fn compare_end(recorded: &End, at: Time, computed: &Result<RunEnd, Fault>) -> Option<Difference> {
    let tell = |end: &RunEnd| {
        let steps = end.steps;
        format!("{} after {steps} control steps", end.verdict)
    };
    let recorded = match recorded {
        End::Ended(end) => tell(end),
        End::Failed { fault } => fault.clone(),
        End::WentOn => return None,
    };
    let computed = match computed {
        Ok(end) => tell(end),
        Err(fault) => fault.to_string(),
    };
    (recorded != computed).then(|| Difference {
        at,
        what: "the end of the run".to_owned(),
        recorded,
        computed,
    })
}

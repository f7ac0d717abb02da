//! The run that comes of a recording.

use std::{
    ops::ControlFlow,
    panic::resume_unwind,
    sync::Arc,
    thread::{self, Scope, ScopedJoinHandle},
    time::Duration,
};

use crossbeam_channel::{RecvTimeoutError, Sender, bounded};
use ratelab::{
    experiment::{Config, Experiment, Taps},
    runtime::{ClockKind, Speed, Time, TimedKnob, telemetry::Event},
    system::{BuildError, System},
};

use super::{
    VerifyError,
    compare::Comparison,
    difference::Difference,
    end, events,
    series::{Messages, Ticks},
    topology,
};
use crate::recording::{
    durations::with_durations,
    reader::Recording,
    schema::{RecordingEnd, RunResult, RunStatus},
};

/// Run time that a run may go on after it ended when it was recorded, until that
/// is what is different.
const GRACE: Duration = Duration::from_secs(1);

/// Run time for which a run may be silent: the period of the slowest node there
/// can be.
const SILENCE: Duration = Duration::from_secs(1_000);

/// Wall time between two looks at the progress of the run.
const PERIOD: Duration = Duration::from_millis(100);

/// Messages or ticks that may wait to be compared.
const BACKLOG: usize = 1024;

/// Runs it again with `system`; what is different. `watch` is given the run time
/// now and then, and may end it.
pub fn run_again(
    recording: &Recording,
    system: &Arc<dyn System>,
    mut watch: impl FnMut(Time) -> ControlFlow<()> + Send,
) -> Result<Vec<Difference>, VerifyError> {
    let whole = recording
        .outcome
        .as_ref()
        .filter(|outcome| outcome.end != RunStatus::WentOn);
    let config = with_tables(config_again(recording, whole))?;
    // Missing files are errors before the comparison begins.
    let turned: Vec<TimedKnob> = recording.events.iter().filter_map(Event::knob).collect();
    let needed = Config {
        knobs: turned.clone(),
        ..config.clone()
    };
    needed.resolved(&**system)?;
    let mut experiment = Experiment::again(system.clone(), &config, &taken(&config, turned))?;
    let observer = experiment.observer();
    let topology = &recording.origin.topology;
    let before =
        topology::compare(topology, &observer.topology()).or_else(|| events::check(recording));
    if let Some(difference) = before {
        return Ok(vec![difference]);
    }
    experiment.schedule(events::commands(recording, &**system)?);
    let comparison = Comparison::new(recording, whole.is_some(), experiment.commands());
    let taps = experiment.taps();
    let (over, watched) = bounded(0);
    let (mut differences, outcome, stopped) = thread::scope(|scope| {
        let comparison = &comparison;
        let checks = compare(scope, comparison, recording, taps);
        let observer = &observer;
        let watch = scope.spawn(move || {
            while watched.recv_timeout(PERIOD) == Err(RecvTimeoutError::Timeout) {
                if watch(observer.now()).is_break() {
                    comparison.stop();
                    return true;
                }
            }
            false
        });
        let outcome = experiment.run();
        drop::<Sender<()>>(over);
        let found: Vec<_> = checks.into_iter().filter_map(found).collect();
        let stopped = watch.join().unwrap_or_else(|panic| resume_unwind(panic));
        (found, outcome, stopped)
    });
    if stopped {
        return Err(VerifyError::Stopped);
    }
    if differences.is_empty() {
        let events = observer.events(0);
        let complete = whole.is_some();
        differences.extend(events::compare(recording, &**system, complete, &events));
    }
    if differences.is_empty() {
        let ended = outcome.map(|summary| RunResult::new(&**system, &summary));
        differences.extend(whole.and_then(|end| end::compare(end, topology, &ended, &observer)));
    }
    Ok(differences)
}

/// The knobs that the recorded run took: those of its setup, and those that were
/// `turned` while it ran.
fn taken(config: &Config, mut turned: Vec<TimedKnob>) -> Vec<TimedKnob> {
    let before = config.setup.iter().cloned();
    let at = Time::ZERO;
    turned.extend(before.map(|knob| TimedKnob { at, knob }));
    turned
}

/// `config` with the measured durations that its knobs draw from.
fn with_tables(mut config: Config) -> Result<Config, BuildError> {
    let knobs = config.setup.iter().cloned().map(with_durations);
    let knobs = knobs.collect::<Result<_, _>>();
    config.setup = knobs.map_err(BuildError::Setting)?;
    Ok(config)
}

/// Compares every topic and every node with what was recorded of it, each on a
/// thread of its own.
fn compare<'scope>(
    scope: &'scope Scope<'scope, '_>,
    comparison: &'scope Comparison,
    recording: &'scope Recording,
    taps: Taps,
) -> Vec<Check<'scope>> {
    let nodes = recording.origin.topology.nodes.iter();
    // A tap that is never emptied would block the run for ever.
    let nodes = nodes.zip(&recording.ticks).zip(taps.ticks(BACKLOG));
    let mut checks: Vec<Check<'_>> = nodes
        .map(|((node, ticks), tap)| {
            let series = Ticks::new(&node.name, ticks, tap);
            scope.spawn(move || comparison.compare(series))
        })
        .collect();
    for topic in taps.topics() {
        let recorded = recording.topic(topic.name());
        let tapped = taps.rows(topic.name(), BACKLOG);
        checks.extend(recorded.zip(tapped).map(|((name, rows), tap)| {
            let series = Messages::new(name, topic.fields(), rows, tap);
            scope.spawn(move || comparison.compare(series))
        }));
    }
    checks
}

/// A comparison that is under way.
type Check<'scope> = ScopedJoinHandle<'scope, Option<Difference>>;

/// The result of a comparison. A panic is passed on: it must not count as no difference.
fn found(check: Check<'_>) -> Option<Difference> {
    check.join().unwrap_or_else(|panic| resume_unwind(panic))
}

/// The configuration of the new run: no longer than the recording, as a run that ended
/// early may not end now.
fn config_again(recording: &Recording, whole: Option<&RecordingEnd>) -> Config {
    let given = &recording.origin.config;
    let messages = recording
        .topics
        .iter()
        .filter_map(|rows| rows.heads().last());
    let ticks = recording.ticks.iter().filter_map(|ticks| ticks.last());
    let stamps = messages.map(|head| head.at);
    let last = stamps.chain(ticks.map(|tick| tick.at)).max();
    let last = last.unwrap_or(Time::ZERO);
    let event = recording.events.iter().map(|event| event.at).max();
    let event = event.unwrap_or(Time::ZERO);
    Config {
        clock: ClockKind::Virtual,
        speed: Speed::Unlimited,
        knobs: Vec::new(),
        end: match whole {
            Some(outcome) => given.end.min(outcome.at.min(last + SILENCE) + GRACE),
            None => recording.until.min(last.max(event)),
        },
        ..given.clone()
    }
}

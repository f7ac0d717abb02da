//! The run that comes of a recording.

use std::{
    ops::ControlFlow,
    panic::resume_unwind,
    thread::{self, Scope, ScopedJoinHandle},
    time::Duration,
};

use crossbeam_channel::{RecvTimeoutError, Sender, bounded};
use ratelab::{
    cartpole::{Action, ControlStep, Observation},
    experiment::{ACTION, Config, Experiment, OBS, STATE, SetupError, TimedKnob},
    policy::PolicyCache,
    runtime::{ClockKind, Speed, Tap, TapMessage, TickRecord, Time},
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
    reader::Recording,
    schema::{RecordingEnd, RunStatus},
    topic_record::TopicRecord,
};

/// Run time that a run may go on after it ended when it was recorded, until that
/// is what is different.
const GRACE: Duration = Duration::from_secs(1);

/// Run time for which a run may say nothing: that of the slowest sensor there
/// can be.
const SILENCE: Duration = Duration::from_secs(1_000);

/// Wall time between two looks at how far the run is.
const PERIOD: Duration = Duration::from_millis(100);

/// Messages or ticks that may wait to be compared.
const BACKLOG: usize = 1024;

/// Runs it again; what is different. `watch` is told the run time now and then,
/// and may end it.
pub fn run_again(
    recording: &Recording,
    tracks: [Option<&TopicRecord>; 3],
    mut watch: impl FnMut(Time) -> ControlFlow<()> + Send,
) -> Result<Vec<Difference>, VerifyError> {
    let whole = recording
        .outcome
        .as_ref()
        .filter(|outcome| outcome.end != RunStatus::WentOn);
    let config = config_again(recording, whole);
    let turned = recording.events.iter().filter_map(TimedKnob::of);
    let turned: Vec<TimedKnob> = turned.collect();
    let swaps = turned.iter().filter_map(|timed| timed.knob.policy());
    // What cannot be had any more is said before anything is compared.
    let cache = PolicyCache::of(config.policies().chain(swaps)).map_err(SetupError::from)?;
    let mut experiment = Experiment::with_cache(&config, cache)?;
    let observer = experiment.observer();
    let topology = &recording.origin.topology;
    let before =
        topology::compare(topology, &observer.topology()).or_else(|| events::check(recording));
    if let Some(difference) = before {
        return Ok(vec![difference]);
    }
    experiment.schedule(events::commands(recording));
    let comparison = Comparison::new(recording, whole.is_some(), experiment.commands());
    let taps = ComparedTaps::new(&experiment, recording);
    let (over, watched) = bounded(0);
    let (mut differences, outcome, stopped) = thread::scope(|scope| {
        let comparison = &comparison;
        let checks = taps.compare(scope, comparison, tracks);
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
        differences.extend(events::compare(
            recording,
            whole.is_some(),
            &observer.events(0),
        ));
    }
    if differences.is_empty() {
        let ended = outcome.map(|summary| summary.end());
        differences.extend(whole.and_then(|end| end::compare(end, topology, &ended, &observer)));
    }
    Ok(differences)
}

/// Taps on everything that is compared.
struct ComparedTaps<'a> {
    observations: Tap<TapMessage<Observation>>,
    actions: Tap<TapMessage<Action>>,
    steps: Tap<TapMessage<ControlStep>>,
    ticks: Vec<(Ticks<'a>, Tap<TickRecord>)>,
}

impl<'a> ComparedTaps<'a> {
    fn new(experiment: &Experiment, recording: &'a Recording) -> Self {
        let taps = experiment.taps();
        // A tap that nobody empties would hold the run up for ever.
        let ticks = ticks(recording).zip(taps.ticks(BACKLOG)).collect();
        Self {
            observations: taps.observations(BACKLOG),
            actions: taps.actions(BACKLOG),
            steps: taps.steps(BACKLOG),
            ticks,
        }
    }

    /// Compares each with what was recorded, on a thread of its own.
    fn compare<'scope>(
        self,
        scope: &'scope Scope<'scope, '_>,
        comparison: &'scope Comparison,
        [observed, acted, stepped]: [Option<&'scope TopicRecord>; 3],
    ) -> Vec<Check<'scope>>
    where
        'a: 'scope,
    {
        let Self {
            observations,
            actions,
            steps,
            ticks,
        } = self;
        let mut checks = vec![
            scope.spawn(move || comparison.compare(&Messages::of(OBS, observed?), observations)),
            scope.spawn(move || comparison.compare(&Messages::of(ACTION, acted?), actions)),
            scope.spawn(move || comparison.compare(&Messages::of(STATE, stepped?), steps)),
        ];
        let ticks = ticks.into_iter();
        checks
            .extend(ticks.map(|(ticks, tap)| scope.spawn(move || comparison.compare(&ticks, tap))));
        checks
    }
}

/// A comparison that is under way.
type Check<'scope> = ScopedJoinHandle<'scope, Option<Difference>>;

/// What a comparison found. One that broke off found nothing, which must not pass
/// for no difference.
fn found(check: Check<'_>) -> Option<Difference> {
    check.join().unwrap_or_else(|panic| resume_unwind(panic))
}

/// What to run: no longer than there is something to compare with, and what
/// ended early may not end at all now.
fn config_again(recording: &Recording, whole: Option<&RecordingEnd>) -> Config {
    let given = &recording.origin.config;
    let messages = recording.topics.iter().filter_map(|t| t.heads.last());
    let ticks = recording.ticks.iter().filter_map(|ticks| ticks.last());
    let stamps = messages.map(|head| head.stamp);
    let last = stamps.chain(ticks.map(|tick| tick.at)).max();
    let last = last.unwrap_or(Time::ZERO);
    let event = recording.events.iter().map(|event| event.at).max();
    let event = event.unwrap_or(Time::ZERO);
    Config {
        clock: ClockKind::Virtual,
        speed: Speed::Unlimited,
        think: Duration::ZERO,
        knobs: Vec::new(),
        end: match whole {
            Some(outcome) => given.end.min(outcome.at.min(last + SILENCE) + GRACE),
            None => recording.until.min(last.max(event)),
        },
        ..given.clone()
    }
}

/// The ticks that were recorded, a series per node.
fn ticks(recording: &Recording) -> impl Iterator<Item = Ticks<'_>> {
    let nodes = recording.origin.topology.nodes.iter();
    nodes.zip(&recording.ticks).map(|(node, ticks)| Ticks {
        node: &node.name,
        ticks,
    })
}

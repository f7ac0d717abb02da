//! The run that comes of a recording.

use std::{
    ops::ControlFlow,
    panic::resume_unwind,
    sync::Arc,
    thread::{self, Scope, ScopedJoinHandle},
    time::{Duration, Instant},
};

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, bounded};
use ratelab::{Event, Knob, Speed, Time};
use ratelab_account::{Observer, RowTap, Rows, Tap, TickRecord};
use ratelab_replay::{BusyNode, Doing, Rerun, Watch};
use ratelab_study::{
    experiment::{Config, Experiment, Taps},
    system::{BuildError, System},
};

use super::{
    Identical, VerifyError,
    compare::Comparison,
    difference::Difference,
    end, events, order,
    series::{Messages, Source, Ticks},
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

/// Wall time that a node may be in one tick beyond its recorded duration.
const LONGEST_TICK: Duration = Duration::from_secs(10);

/// What a watcher sees of a run.
#[derive(Clone, Debug)]
pub struct VerifyStatus {
    /// Run time.
    pub now: Time,
    /// The node that the run waits for in vain: it cannot be stopped.
    pub stuck: Option<BusyNode>,
}

/// The result of a run.
pub struct Outcome {
    /// The first difference of each series, or of the rest.
    pub differences: Vec<Difference>,
    /// Where the nodes left the recorded order, if they did.
    pub diverged: Option<String>,
    /// What is the same.
    pub identical: Identical,
}

impl Outcome {
    /// Of a run that was not begun.
    fn of(difference: Difference) -> Self {
        Self {
            differences: vec![difference],
            diverged: None,
            identical: Identical::default(),
        }
    }

    fn is_same(&self) -> bool {
        self.differences.is_empty() && self.diverged.is_none()
    }
}

/// Runs it again with `system`, in the order of `rerun` where it was under the real clock;
/// what is different. `watch` looks on now and then, and may end it.
pub fn run_again(
    recording: &Recording,
    system: &Arc<dyn System>,
    mut rerun: Option<Rerun>,
    watch: impl FnMut(&VerifyStatus) -> ControlFlow<()> + Send,
) -> Result<Outcome, VerifyError> {
    let whole = end_of(recording);
    let mut experiment = experiment_again(recording, system, whole)?;
    let observer = experiment.observer();
    let topology = &recording.origin.topology;
    let before = topology::compare(topology, &observer.topology())
        .or_else(|| events::check(recording, rerun.is_some()));
    if let Some(difference) = before {
        return Ok(Outcome::of(difference));
    }
    let complete = is_complete(recording, rerun.is_some());
    experiment.schedule(events::commands(recording, &**system, rerun.as_ref())?);
    let comparison = Comparison::new(recording, complete, rerun.is_some(), experiment.commands());
    let watcher = RunWatcher {
        observer: observer.clone(),
        rerun: rerun.as_ref().map(Rerun::watch),
        last: None,
        watch,
    };
    let taps = experiment.taps();
    let (over, watched) = bounded(0);
    let (differences, outcome, stopped) = thread::scope(|scope| {
        let comparison = &comparison;
        let checks = compare(scope, comparison, recording, taps);
        let watch = scope.spawn(move || watcher.stops(&watched, comparison));
        let outcome = match &mut rerun {
            Some(rerun) => experiment.run_with(rerun),
            None => experiment.run(),
        };
        drop::<Sender<()>>(over);
        let found: Vec<_> = checks.into_iter().filter_map(joined).collect();
        let stopped = joined(watch);
        (found, outcome, stopped)
    });
    if stopped {
        return Err(VerifyError::Stopped);
    }
    let mut result = Outcome {
        diverged: rerun.as_ref().and_then(Rerun::difference),
        identical: comparison.identical(recording, &observer),
        differences,
    };
    if result.is_same() {
        let events = observer.events(0);
        let difference = events::compare(recording, &**system, complete, &events);
        result.differences.extend(difference);
    }
    if let Some(end) = whole.filter(|_| result.is_same() && complete) {
        let ended = outcome.map(|summary| RunResult::new(&**system, &summary));
        let rest = (newest_item(recording), comparison.lacks());
        let difference = end::compare(end, topology, &ended, &observer, rest);
        result.differences.extend(difference);
    }
    Ok(result)
}

/// The end of the recorded run, if the recording goes on to it.
fn end_of(recording: &Recording) -> Option<&RecordingEnd> {
    let outcome = recording.outcome.as_ref();
    outcome.filter(|outcome| outcome.end != RunStatus::WentOn)
}

/// Whether the recording goes on to the end of the run; with `threads` it was under the real
/// clock.
pub fn is_complete(recording: &Recording, threads: bool) -> bool {
    end_of(recording).is_some() && (!threads || order::is_whole(recording))
}

/// Run time of the last tick, message or event: under the real clock it may be late, and come
/// after the end.
fn newest_item(recording: &Recording) -> Time {
    let ticks = recording.ticks.iter().filter_map(|ticks| ticks.last());
    let topics = recording.topics.iter();
    let messages = topics.filter_map(|rows| rows.heads().last());
    let items = messages
        .map(|head| head.at)
        .chain(ticks.map(|tick| tick.at))
        .chain(recording.events.iter().map(|event| event.at));
    items.max().unwrap_or_default()
}

/// Looks on.
struct RunWatcher<W> {
    observer: Observer,
    rerun: Option<Arc<Watch>>,
    /// What the run did when it last did something else, and when that was.
    last: Option<(Doing, Instant)>,
    watch: W,
}

impl<W: FnMut(&VerifyStatus) -> ControlFlow<()>> RunWatcher<W> {
    /// Looks on until the run is over, or until it is to stop: then it returns true.
    fn stops(mut self, over: &Receiver<()>, comparison: &Comparison) -> bool {
        while over.recv_timeout(PERIOD) == Err(RecvTimeoutError::Timeout) {
            if self.look().is_break() {
                comparison.stop();
                return true;
            }
        }
        false
    }

    fn look(&mut self) -> ControlFlow<()> {
        let doing = self.rerun.as_ref().map(|rerun| rerun.doing());
        let stuck = doing.and_then(|doing| match &self.last {
            Some((last, since)) if *last == doing => {
                doing.node.filter(|node| is_stuck(node, since.elapsed()))
            }
            _ => {
                self.last = Some((doing, Instant::now()));
                None
            }
        });
        let now = self.observer.now();
        (self.watch)(&VerifyStatus { now, stuck })
    }
}

/// Whether a tick of `node` has gone on for so long that it waits in vain.
fn is_stuck(node: &BusyNode, busy: Duration) -> bool {
    busy > node.took.saturating_add(LONGEST_TICK)
}

/// The run of `recording`, ready to be executed again. Missing files are errors before the
/// comparison begins.
fn experiment_again(
    recording: &Recording,
    system: &Arc<dyn System>,
    whole: Option<&RecordingEnd>,
) -> Result<Experiment, BuildError> {
    let config = with_tables(config_again(recording, whole))?;
    let needed = Config {
        knobs: recording.events.iter().filter_map(Event::knob).collect(),
        ..config.clone()
    };
    needed.resolved(&**system)?;
    Experiment::again(system.clone(), &config, &recording.knobs())
}

/// `config` with the measured durations that its knobs draw from.
pub fn with_tables(mut config: Config) -> Result<Config, BuildError> {
    config.setup = loaded(config.setup.iter().cloned())?;
    Ok(config)
}

/// `knobs` with the measured durations that they draw from.
pub fn loaded<K: FromIterator<Knob>>(knobs: impl Iterator<Item = Knob>) -> Result<K, BuildError> {
    let knobs = knobs.map(with_durations).collect::<Result<_, _>>();
    knobs.map_err(BuildError::Setting)
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
            let series = Ticks::new(&node.name, ticks, ticks_of(tap));
            scope.spawn(move || comparison.compare(series))
        })
        .collect();
    for topic in taps.topics() {
        let recorded = recording.topic(topic.name());
        let tapped = taps.rows(topic.name(), BACKLOG);
        checks.extend(recorded.zip(tapped).map(|((name, rows), tap)| {
            let series = Messages::new(name, topic.fields(), rows, messages_of(tap));
            scope.spawn(move || comparison.compare(series))
        }));
    }
    checks
}

fn ticks_of<'a>(tap: Tap<TickRecord>) -> Source<'a, Vec<TickRecord>> {
    Box::new(move |taken| {
        let items = tap.items();
        taken.extend(items.recv());
        // No more than there is now: the run fills it as fast.
        taken.extend(items.try_iter().take(items.len()));
        !taken.is_empty()
    })
}

fn messages_of<'a>(tap: RowTap) -> Source<'a, Rows> {
    Box::new(move |taken| tap.wait(taken))
}

/// A comparison that is under way.
type Check<'scope> = ScopedJoinHandle<'scope, Option<Difference>>;

/// The result of a thread. A panic is passed on: it must not count as no difference.
pub fn joined<T>(thread: ScopedJoinHandle<'_, T>) -> T {
    thread.join().unwrap_or_else(|panic| resume_unwind(panic))
}

/// The configuration of the new run: no longer than the recording, as a run that ended
/// early may not end now.
pub fn config_again(recording: &Recording, whole: Option<&RecordingEnd>) -> Config {
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
        speed: Speed::Unlimited,
        knobs: Vec::new(),
        end: match whole {
            Some(outcome) => given.end.min(outcome.at.min(last + SILENCE) + GRACE),
            None => recording.until.min(last.max(event)),
        },
        ..given.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tick_that_was_long_when_it_was_recorded_is_not_stuck() {
        let node = BusyNode {
            name: "policy".into(),
            at: Time::ZERO,
            took: Duration::from_secs(12),
        };
        assert!(!is_stuck(&node, Duration::from_secs(13)));
        assert!(is_stuck(&node, Duration::from_secs(23)));
    }
}

//! The run that comes of a recording.

use std::{
    ops::ControlFlow,
    panic::resume_unwind,
    sync::Arc,
    thread::{self, ScopedJoinHandle},
    time::{Duration, Instant},
};

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, bounded};
use ratelab::{Event, Fault, Knob, Speed, Time, Topology};
use ratelab_account::{Observer, Rows, TickRecord};
use ratelab_replay::{BusyNode, Doing, Rerun, Watch};
use ratelab_study::{
    experiment::{Config, Experiment, Summary},
    system::{BuildError, System},
};

use super::{
    Identical, VerifyError,
    compare::{Comparison, RecordedSeries},
    difference::Difference,
    end, events, topology,
};
use crate::{durations::with_durations, recorded::Recording, schema::RunResult, source::Tapped};

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

/// What came of a recorded run.
pub struct RanAgain {
    /// The messages of its topics, if they are kept.
    pub topics: Vec<Rows>,
    /// The ticks of its nodes, if they are kept.
    pub ticks: Vec<Vec<TickRecord>>,
    /// Its end.
    pub end: Result<Summary, Fault>,
    /// Where the nodes left the recorded order, if they did.
    pub diverged: Option<String>,
    /// Whether it was stopped by who watched it.
    pub stopped: bool,
}

/// Runs `experiment`, in the order of `rerun` where it was under the real clock, and compares
/// every topic and every node, each on a thread of its own. `watch` looks on until the run is
/// over; then it returns false.
pub fn run_again(
    experiment: Experiment,
    mut rerun: Option<Rerun>,
    comparison: &Comparison<'_>,
    watch: impl FnOnce(&Receiver<()>) -> bool + Send,
) -> RanAgain {
    let recording = comparison.recording;
    let Topology { topics, nodes } = &recording.origin.topology;
    let taps = experiment.taps();
    let (over, watched) = bounded(0);
    thread::scope(|scope| {
        // A tap that is never emptied would block the run for ever.
        let nodes = nodes.iter().zip(&recording.ticks).zip(taps.ticks(BACKLOG));
        let nodes = nodes.map(|((node, series), tap)| {
            let recorded = RecordedSeries::new(&node.name, &[], series);
            scope.spawn(move || comparison.check(&recorded, tap))
        });
        let nodes: Vec<_> = nodes.collect();
        let topics = topics.iter().zip(&recording.topics).map(|(topic, series)| {
            let name = &*topic.name;
            let recorded = RecordedSeries::new(name, Tapped::fields(&taps, name)?, series);
            let tap = taps.rows(name, BACKLOG)?;
            Some(scope.spawn(move || comparison.check(&recorded, tap)))
        });
        let topics: Vec<_> = topics.collect();
        drop(taps);
        let watch = scope.spawn(move || watch(&watched));
        let end = match &mut rerun {
            Some(rerun) => experiment.run_with(rerun),
            None => experiment.run(),
        };
        drop::<Sender<()>>(over);
        let topics = topics.into_iter().map(|topic| topic.map(joined));
        RanAgain {
            ticks: nodes.into_iter().map(joined).collect(),
            topics: topics.map(Option::unwrap_or_default).collect(),
            end,
            diverged: rerun.as_ref().and_then(Rerun::difference),
            stopped: joined(watch),
        }
    })
}

/// The run of `recording`, prepared to be executed again with `config`.
pub fn prepare(
    recording: &Recording,
    system: &Arc<dyn System>,
    config: Config,
    rerun: Option<&Rerun>,
) -> Result<Experiment, BuildError> {
    let config = with_tables(config)?;
    let mut experiment = Experiment::again(system.clone(), &config, &recording.knobs())?;
    experiment.schedule(events::commands(recording, &**system, rerun)?);
    Ok(experiment)
}

/// Runs it again with `system`, in the order of `rerun` where it was under the real clock, and
/// compares all of it. `watch` looks on now and then, and may end it.
pub fn compare(
    recording: &Recording,
    system: &Arc<dyn System>,
    rerun: Option<Rerun>,
    watch: impl FnMut(&VerifyStatus) -> ControlFlow<()> + Send,
) -> Result<Outcome, VerifyError> {
    let threads = rerun.is_some();
    let config = with_tables(config_again(recording))?;
    // Missing files are errors before the comparison begins.
    let needed = Config {
        knobs: recording.events.iter().filter_map(Event::knob).collect(),
        ..config.clone()
    };
    needed.resolved(&**system)?;
    let experiment = prepare(recording, system, config, rerun.as_ref())?;
    let observer = experiment.observer();
    let topology = &recording.origin.topology;
    let before = topology::compare(topology, &observer.topology())
        .or_else(|| events::check(recording, threads));
    if before.is_some() {
        return Ok(Outcome {
            difference: before,
            ..Outcome::default()
        });
    }
    let comparison = Comparison::new(recording, threads, experiment.commands());
    let watcher = RunWatcher {
        observer: observer.clone(),
        rerun: rerun.as_ref().map(Rerun::watch),
        last: None,
        watch,
    };
    let ran = run_again(experiment, rerun, &comparison, |over| {
        watcher.stops(over, &comparison)
    });
    if ran.stopped {
        return Err(VerifyError::Stopped);
    }
    let mut difference = comparison.first_difference();
    if difference.is_none() && ran.diverged.is_none() {
        difference = compare_rest(&comparison, system, &observer, ran.end);
    }
    Ok(Outcome {
        difference,
        diverged: ran.diverged,
        identical: comparison.identical(observer.now()),
    })
}

/// The first difference in what is no row: an event, or the end.
fn compare_rest(
    comparison: &Comparison<'_>,
    system: &Arc<dyn System>,
    observer: &Observer,
    ended: Result<Summary, Fault>,
) -> Option<Difference> {
    let (recording, complete) = (comparison.recording, comparison.complete);
    let events = observer.events(0);
    events::compare(recording, &**system, complete, &events).or_else(|| {
        let end = recording.end_of_run().filter(|_| complete)?;
        let result = |run: Summary| RunResult::new(&**system, &run);
        let rest = (recording.last_item(), comparison.lacks());
        let topology = &recording.origin.topology;
        end::compare(end, topology, &ended.map(result), observer, rest)
    })
}

/// The result of a comparison.
#[derive(Default)]
pub struct Outcome {
    /// The first difference.
    pub difference: Option<Difference>,
    /// Where the nodes left the recorded order, if they did.
    pub diverged: Option<String>,
    /// What is the same.
    pub identical: Identical,
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
    fn stops(mut self, over: &Receiver<()>, comparison: &Comparison<'_>) -> bool {
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

/// The result of a thread. A panic is passed on: it must not count as no difference.
fn joined<T>(thread: ScopedJoinHandle<'_, T>) -> T {
    thread.join().unwrap_or_else(|panic| resume_unwind(panic))
}

/// The configuration of the new run: no longer than the recording, as a run that ended
/// early may not end now.
fn config_again(recording: &Recording) -> Config {
    let given = &recording.origin.config;
    Config {
        speed: Speed::Unlimited,
        knobs: Vec::new(),
        end: match recording.end_of_run() {
            Some(outcome) => {
                let silent = recording.last_row() + SILENCE;
                given.end.min(outcome.at.min(silent) + GRACE)
            }
            None => recording.until.min(recording.last_item()),
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

//! The run that comes of a recording.

use std::{
    ops::ControlFlow,
    panic::resume_unwind,
    sync::Arc,
    thread,
    time::{Duration, Instant},
};

use crossbeam_channel::{RecvTimeoutError, Sender};
use ratelab::{Command, Event, Fault, Knob, Speed, Time};
use ratelab_experiment::{Config, Experiment, Summary};
use ratelab_metrics::{Observer, RunRow, Tap};
use ratelab_re_execution::{BusyNode, Doing, ReExecution, Watch};
use ratelab_system::{AnswersOfNodes, BuildError, Setup, System};

use super::{
    Identical, VerifyError,
    compare::Comparison,
    difference::{self, Difference},
    events,
};
use crate::{
    recorder::StopReason,
    run::{Recording, RecordingEnd},
};

/// Run time that a run may go on after it ended when it was recorded, until that
/// is what is different.
const GRACE: Duration = Duration::from_secs(1);

/// Run time for which a run may be silent: the period of the slowest node there
/// can be.
const SILENCE: Duration = Duration::from_secs(1_000);

/// Wall time between two looks at the progress of the run.
const PERIOD: Duration = Duration::from_millis(100);

/// Rows that may wait to be compared.
const BACKLOG: usize = 4096;

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

impl VerifyStatus {
    /// At run time `now`, and after `node` has been in one tick for `busy` of wall time.
    pub fn new(now: Time, node: Option<BusyNode>, busy: Duration) -> Self {
        let in_vain = |node: &BusyNode| busy > node.took.saturating_add(LONGEST_TICK);
        let stuck = node.filter(in_vain);
        Self { now, stuck }
    }
}

/// What came of a recorded run.
pub struct RanAgain {
    /// Its end.
    pub end: Result<Summary, Fault>,
    /// The first difference in its rows.
    pub difference: Option<Difference>,
    /// Where the nodes left the recorded order, if they did.
    pub diverged: Option<String>,
    /// Whether it was stopped by who watched it.
    pub stopped: bool,
}

/// Runs `experiment`, in the order of `re_execution` where it was under the real clock. `compare` gets
/// its rows as they come, until one differs; `watch` looks on now and then. Each may end it.
pub fn run_again(
    experiment: Experiment,
    mut re_execution: Option<ReExecution>,
    compare: impl FnMut(RunRow) -> Option<Difference> + Send,
    watch: impl FnMut() -> ControlFlow<()> + Send,
) -> RanAgain {
    let (tap, commands) = (experiment.taps().all(BACKLOG), experiment.commands());
    thread::scope(|scope| {
        let follower = scope.spawn(move || follow(&tap, &commands, compare, watch));
        let end = match &mut re_execution {
            Some(re_execution) => experiment.run_with(re_execution),
            None => experiment.run(),
        };
        // A panic is passed on: it must not count as no difference.
        let (difference, stopped) = follower.join().unwrap_or_else(|panic| resume_unwind(panic));
        RanAgain {
            end,
            difference,
            diverged: re_execution.as_ref().and_then(ReExecution::difference),
            stopped,
        }
    })
}

/// Empties `tap` to its end: the run waits for it. Returns the first difference, and whether the
/// watcher stopped the run.
fn follow(
    tap: &Tap<RunRow>,
    commands: &Sender<Command>,
    mut compare: impl FnMut(RunRow) -> Option<Difference>,
    mut watch: impl FnMut() -> ControlFlow<()>,
) -> (Option<Difference>, bool) {
    let (mut difference, mut stopped, mut looked) = (None, false, Instant::now());
    loop {
        let before = (difference.is_some(), stopped);
        match tap.items().recv_timeout(PERIOD) {
            Ok(row) if before == (false, false) => difference = compare(row),
            Ok(_) | Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return (difference, stopped),
        }
        if !stopped && looked.elapsed() >= PERIOD {
            stopped = watch().is_break();
            looked = Instant::now();
        }
        if before != (difference.is_some(), stopped) {
            let _ = commands.send(Command::Stop); // It may be over.
        }
    }
}

/// Returns the run of `recording`, prepared to be executed again with `config`.
pub fn prepare(
    recording: &Recording,
    system: &Arc<dyn System>,
    config: Config,
    answers: AnswersOfNodes,
    re_execution: Option<&ReExecution>,
) -> Result<Experiment, BuildError> {
    let config = with_tables(recording, config)?;
    let mut experiment = Experiment::again(system.clone(), &config, &recording.knobs(), answers)?;
    experiment.schedule(events::commands(recording, &**system, re_execution)?);
    Ok(experiment)
}

/// Runs it again with `system`, in the order of `re_execution` where it was under the real clock, and
/// compares all of it; nodes with `answers` give these. `watch` looks on now and then, and may end it.
pub fn compare(
    recording: &Recording,
    system: &Arc<dyn System>,
    answers: AnswersOfNodes,
    re_execution: Option<ReExecution>,
    watch: impl FnMut(&VerifyStatus) -> ControlFlow<()> + Send,
) -> Result<Identical, VerifyError> {
    let threads = re_execution.is_some();
    let config = with_tables(recording, config_again(recording))?;
    // Missing files are errors before the comparison begins.
    let needed = Config {
        knobs: recording.events.iter().filter_map(Event::knob).collect(),
        ..config.clone()
    };
    let whole = needed.resolved(&**system)?.setup;
    let experiment = prepare(recording, system, config, answers, re_execution.as_ref())?;
    let observer = experiment.observer();
    let topology = &recording.origin.topology;
    let before = difference::compare_topology(topology, &observer.topology())
        .or_else(|| left_out(&recording.origin.config.setup, &whole))
        .or_else(|| events::check(recording, threads));
    super::judge(recording, system, threads, before, None)?;
    let mut comparison = Comparison::new(recording, threads, &experiment.taps());
    let mut watcher = RunWatcher {
        observer: observer.clone(),
        re_execution: re_execution.as_ref().map(ReExecution::watch),
        last: None,
        watch,
    };
    let compare = |row| comparison.row(&row);
    let ran = run_again(experiment, re_execution, compare, || watcher.look());
    if ran.stopped {
        return Err(VerifyError::Stopped);
    }
    let mut difference = ran.difference.or_else(|| comparison.missing());
    if difference.is_none() && ran.diverged.is_none() {
        difference = compare_rest(&comparison, system, &observer, &ran.end);
    }
    super::judge(recording, system, threads, difference, ran.diverged)?;
    Ok(comparison.identical(observer.now()))
}

/// Returns the first setting of the `whole` setup that is not `recorded`: a run records what its
/// system sets, as well as what its user does.
fn left_out(recorded: &Setup, whole: &Setup) -> Option<Difference> {
    let is_recorded = |knob: &&Knob| recorded.iter().any(|known| known.is_of(knob));
    let missing = whole.iter().find(|knob| !is_recorded(knob))?;
    let values = ["none".to_owned(), missing.to_string()];
    Some(Difference::new(Time::ZERO, "a setting", values))
}

/// Returns the first difference in events or the end.
fn compare_rest(
    comparison: &Comparison<'_>,
    system: &Arc<dyn System>,
    observer: &Observer,
    ended: &Result<Summary, Fault>,
) -> Option<Difference> {
    let (recording, gaps) = (comparison.recording, &comparison.gaps);
    let events = observer.events(0);
    events::compare(recording, &**system, gaps.complete, &events).or_else(|| {
        let recorded = recording.end_of_run().filter(|_| gaps.complete)?;
        let end = StopReason::from_outcome(ended).end(&**system, observer);
        let computed = RecordingEnd {
            at: end.at.max(recording.last_item()),
            // What came too fast for the recorder came again.
            lost: gaps.lacks,
            ..end
        };
        difference::compare_end([recorded, &computed], &recording.origin.topology)
    })
}

/// Looks on.
struct RunWatcher<W> {
    observer: Observer,
    re_execution: Option<Arc<Watch>>,
    /// What the run did when it last did something else, and when that was.
    last: Option<(Doing, Instant)>,
    watch: W,
}

impl<W: FnMut(&VerifyStatus) -> ControlFlow<()>> RunWatcher<W> {
    fn look(&mut self) -> ControlFlow<()> {
        let doing = self
            .re_execution
            .as_ref()
            .map(|re_execution| re_execution.doing());
        if self.last.as_ref().map(|(last, _)| last) != doing.as_ref() {
            self.last = doing.map(|doing| (doing, Instant::now()));
        }
        let last = self.last.as_ref();
        let busy = last.map_or(Duration::ZERO, |(_, since)| since.elapsed());
        let node = last.and_then(|(doing, _)| doing.node.clone());
        (self.watch)(&VerifyStatus::new(self.observer.now(), node, busy))
    }
}

/// Returns `config` with the measured durations that its knobs draw from.
pub fn with_tables(recording: &Recording, mut config: Config) -> Result<Config, BuildError> {
    let with_table = |knob: &Knob| events::with_table(recording, knob.clone());
    config.setup = config
        .setup
        .iter()
        .map(with_table)
        .collect::<Result<_, _>>()?;
    for timed in &mut config.knobs {
        timed.knob = with_table(&timed.knob)?;
    }
    Ok(config)
}

/// Returns the configuration of the new run: no longer than the recording, as a run that ended
/// early may not end now.
fn config_again(recording: &Recording) -> Config {
    let given = &recording.origin.config;
    Config {
        speed: Speed::Unlimited,
        knobs: Vec::new(),
        end: match recording.end_of_run() {
            Some(outcome) => {
                let silent = recording.newest().unwrap_or_default() + SILENCE;
                given.end.min(outcome.at.min(silent) + GRACE)
            }
            None => recording.until.min(recording.last_item()),
        },
        ..given.clone()
    }
}

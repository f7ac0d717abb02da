//! Executes a run again for all of its messages and ticks.

use std::{sync::Arc, thread};

use ratelab::{RealClock, Speed};
use ratelab_account::Observer;
use ratelab_replay::{Knot, Rerun};
use ratelab_study::{
    experiment::{Config, Experiment, Taps},
    system::System,
};

use super::{
    VerifyError, again,
    compare::Comparison,
    difference::Difference,
    events,
    held::Held,
    order,
    series::{Messages, Ticks, left},
};
use crate::recording::reader::Recording;

/// Messages or ticks that may wait to be kept.
const BACKLOG: usize = 1024;

/// A run that is to be executed again.
pub struct Execution {
    recording: Arc<Recording>,
    system: Arc<dyn System>,
    experiment: Experiment,
    rerun: Option<Rerun>,
}

/// A run that was executed again.
pub struct Executed {
    /// Its recording, with every message and tick.
    pub recording: Arc<Recording>,
    /// Its ticks that overlap.
    pub knots: Vec<Knot>,
}

impl Execution {
    /// Prepares to execute the run of `recording` again.
    ///
    /// # Errors
    /// [`VerifyError`] if it cannot be executed again.
    pub fn new(recording: Arc<Recording>, system: &Arc<dyn System>) -> Result<Self, VerifyError> {
        super::refuse_foreign(&recording, system)?;
        let rerun = order::rerun(&recording, &**system)?;
        let config = again::with_tables(Config {
            speed: Speed::Unlimited,
            knobs: Vec::new(),
            end: recording.until,
            ..recording.origin.config.clone()
        })?;
        let mut experiment = Experiment::again(system.clone(), &config, &recording.knobs())?;
        experiment.schedule(events::commands(&recording, &**system, rerun.as_ref())?);
        Ok(Self {
            recording,
            system: system.clone(),
            experiment,
            rerun,
        })
    }

    /// Reads the graph while it runs.
    pub fn observer(&self) -> Observer {
        self.experiment.observer()
    }

    /// Begins to execute the run up to the first `operations` of knot number `knot`, and
    /// holds it there; `None` for a run without knots.
    pub fn hold(self, knot: usize, operations: usize) -> Option<Held> {
        let rerun = self.rerun?;
        Some(Held::begin(self.experiment, rerun, (knot, operations)))
    }

    /// Executes the run. Its messages and ticks must be the recorded ones, if the recording
    /// has any.
    ///
    /// # Errors
    /// [`VerifyError`] if it is another run.
    pub fn run(self) -> Result<Executed, VerifyError> {
        let Self {
            recording: recorded,
            system,
            experiment,
            mut rerun,
        } = self;
        let mut recording = recorded.without_rows();
        let knots = rerun.as_ref().map_or_else(Vec::new, Rerun::knots);
        let taps = experiment.taps();
        let ticks = taps.ticks(BACKLOG);
        let names = recording.origin.topology.topics.iter();
        let topics: Vec<_> = names
            .clone()
            .map(|topic| taps.rows(&topic.name, BACKLOG))
            .collect();
        let fields: Vec<_> = names.map(|topic| fields(&taps, &topic.name)).collect();
        drop(taps);
        thread::scope(|scope| {
            let ticks = ticks.into_iter();
            let ticks: Vec<_> = ticks
                .map(|tap| scope.spawn(move || tap.items().iter().collect::<Vec<_>>()))
                .collect();
            let topics = topics.into_iter().map(|tap| {
                scope.spawn(move || {
                    let tap = tap?;
                    let mut rows = tap.rows();
                    while tap.wait(&mut rows) {}
                    Some(rows)
                })
            });
            let topics: Vec<_> = topics.collect();
            // A fault is in the recording already.
            let _ = match &mut rerun {
                Some(rerun) => experiment.run_with(rerun),
                None => experiment.run_with(&mut RealClock::default()),
            };
            let ticks = ticks.into_iter().map(again::joined);
            recording.ticks = ticks.collect();
            let topics = topics.into_iter().map(again::joined);
            recording.topics = topics.map(Option::unwrap_or_default).collect();
        });
        let diverged = rerun.as_ref().and_then(Rerun::difference);
        let threads = rerun.is_some();
        let difference = first_difference(&recorded, &recording, &fields, threads);
        super::judge(&recorded, &system, threads, (difference, diverged))?;
        Ok(Executed {
            recording: Arc::new(recording),
            knots,
        })
    }
}

/// Names of the numbers in the messages of a topic.
fn fields(taps: &Taps, topic: &str) -> &'static [&'static str] {
    let mut topics = taps.topics().iter();
    let known = topics.find(|known| known.name() == topic);
    known.map_or(&[], |known| known.fields())
}

/// The first difference between the `recorded` messages and ticks and those of the run that
/// came of it, whose topics have these `fields`; with `threads` it was under the real clock.
fn first_difference(
    recorded: &Recording,
    computed: &Recording,
    fields: &[&'static [&'static str]],
    threads: bool,
) -> Option<Difference> {
    if recorded.ticks.iter().all(Vec::is_empty) {
        return None;
    }
    let complete = again::is_complete(recorded, threads);
    // The run is over: nobody is left to be stopped.
    let (commands, _) = crossbeam_channel::unbounded();
    let comparison = Comparison::new(recorded, complete, threads, commands);
    let topology = &recorded.origin.topology;
    let nodes = topology.nodes.iter().zip(&recorded.ticks);
    let ticks = nodes
        .zip(&computed.ticks)
        .filter_map(|((node, ticks), new)| {
            comparison.compare(Ticks::new(&node.name, ticks, left(new)))
        });
    let topics = topology.topics.iter().zip(fields).zip(&computed.topics);
    let messages = topics.filter_map(|((topic, fields), new)| {
        let (name, rows) = recorded.topic(&topic.name)?;
        comparison.compare(Messages::new(name, fields, rows, left(new)))
    });
    ticks.chain(messages).min_by_key(|difference| difference.at)
}

//! Executes a run again for all of its messages and ticks.

use std::{sync::Arc, thread};

use ratelab::{
    experiment::{Config, Experiment},
    runtime::{Knot, Observer, RealClock, Rerun, Speed},
    system::System,
};

use super::{VerifyError, again, events, held::Held, order};
use crate::recording::reader::Recording;

/// Messages or ticks that may wait to be kept.
const BACKLOG: usize = 1024;

/// A run that is to be executed again.
pub struct Execution {
    recording: Arc<Recording>,
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

    /// Executes the run.
    ///
    /// # Errors
    /// [`VerifyError`] if it is another run.
    pub fn run(self) -> Result<Executed, VerifyError> {
        let Self {
            recording,
            experiment,
            mut rerun,
        } = self;
        let mut recording = recording.without_rows();
        let knots = rerun.as_ref().map_or_else(Vec::new, Rerun::knots);
        let taps = experiment.taps();
        let ticks = taps.ticks(BACKLOG);
        let names = recording.origin.topology.topics.iter();
        let topics: Vec<_> = names.map(|topic| taps.rows(&topic.name, BACKLOG)).collect();
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
        match rerun.as_ref().and_then(Rerun::difference) {
            Some(diverged) => Err(VerifyError::Diverged(diverged)),
            None => Ok(Executed {
                recording: Arc::new(recording),
                knots,
            }),
        }
    }
}

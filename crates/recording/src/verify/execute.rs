//! Executes a run again for all of its messages and ticks.

use std::{ops::ControlFlow, sync::Arc, thread};

use ratelab::Speed;
use ratelab_experiment::{Config, Experiment};
use ratelab_metrics::{Observer, RunRow};
use ratelab_re_execution::{Overlap, ReExecution, Watch};
use ratelab_system::System;

use super::{VerifyError, again, compare::Comparison, order};
use crate::{recorder::Tapped, run::Recording};

/// A run that is to be executed again.
pub struct Execution {
    recording: Arc<Recording>,
    system: Arc<dyn System>,
    experiment: Experiment,
    re_execution: Option<ReExecution>,
}

/// A run that was executed again.
pub struct Executed {
    /// Its recording, with every message and tick.
    pub recording: Arc<Recording>,
    /// Its ticks that overlap.
    pub overlaps: Vec<Overlap>,
}

impl Execution {
    /// Prepares to execute the run of `recording` again.
    ///
    /// # Errors
    /// [`VerifyError`] if it cannot be executed again.
    pub fn new(recording: Arc<Recording>, system: &Arc<dyn System>) -> Result<Self, VerifyError> {
        super::refuse_foreign(&recording, system)?;
        let re_execution = order::re_execution(&recording, &**system)?;
        let answers = recording.answers(&**system);
        let config = Config {
            speed: Speed::Unlimited,
            knobs: Vec::new(),
            end: recording.until,
            ..recording.origin.config.clone()
        };
        Ok(Self {
            experiment: again::prepare(&recording, system, config, answers, re_execution.as_ref())?,
            recording,
            system: system.clone(),
            re_execution,
        })
    }

    /// Reads the graph while it runs.
    pub fn observer(&self) -> Observer {
        self.experiment.observer()
    }

    /// Begins to execute the run up to the first `operations` of overlap number `overlap`, and
    /// holds it there; `None` for a run without overlaps.
    pub fn hold(self, overlap: usize, operations: usize) -> Option<Held> {
        let (experiment, mut re_execution) = (self.experiment, self.re_execution?);
        re_execution.hold(overlap, operations);
        let (observer, watch) = (experiment.observer(), re_execution.watch());
        // It ends with the hold.
        thread::spawn(move || drop(experiment.run_with(&mut re_execution)));
        Some(Held { observer, watch })
    }

    /// Executes the run. Its messages and ticks must be the recorded ones, if the recording
    /// has any.
    ///
    /// # Errors
    /// [`VerifyError`] if it is another run.
    pub fn run(self) -> Result<Executed, VerifyError> {
        let Self {
            recording,
            system,
            experiment,
            re_execution,
        } = self;
        let threads = re_execution.is_some();
        let overlaps = re_execution
            .as_ref()
            .map_or_else(Vec::new, ReExecution::overlaps);
        let taps = experiment.taps();
        let mut rows = taps.empty_rows(&recording.origin.topology);
        let mut comparison = Comparison::new(&recording, threads, &taps);
        drop(taps);
        // A recording without any tick has nothing to compare them with.
        let compares = recording.ticks.iter().any(|ticks| !ticks.is_empty());
        let keep = |row: RunRow| {
            let difference = compares.then(|| comparison.row(&row)).flatten();
            rows.add(row);
            difference
        };
        let ran = again::run_again(experiment, re_execution, keep, || ControlFlow::Continue(()));
        let missing = || comparison.missing().filter(|_| compares);
        let difference = ran.difference.or_else(missing);
        super::judge(&recording, &system, threads, difference, ran.diverged)?;
        let recording = Arc::new(recording.with_rows(rows));
        Ok(Executed {
            recording,
            overlaps,
        })
    }
}

/// A run that is executed again up to an operation, and held there until this is dropped.
pub struct Held {
    observer: Observer,
    watch: Arc<Watch>,
}

impl Held {
    /// Reads the graph as it is held.
    pub fn observer(&self) -> &Observer {
        &self.observer
    }

    /// Lets it go on to the first `operations` of the overlap.
    pub fn allow(&self, operations: usize) {
        self.watch.allow(operations);
    }

    /// Returns the number of operations done; `None` before all nodes are at rest there.
    pub fn done(&self) -> Option<usize> {
        self.watch.held()
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        self.watch.end();
    }
}

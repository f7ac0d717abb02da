//! A recorded run, held between two operations of ticks that overlap.

use std::{sync::Arc, thread};

use ratelab_account::Observer;
use ratelab_replay::{Rerun, Watch};
use ratelab_study::experiment::Experiment;

/// A run that is executed again up to an operation, and held there until this is dropped.
pub struct Held {
    observer: Observer,
    watch: Arc<Watch>,
}

impl Held {
    /// Begins to execute `experiment` with `rerun` again, up to the first `operations` of
    /// knot number `knot`.
    pub(super) fn begin(
        experiment: Experiment,
        mut rerun: Rerun,
        (knot, operations): (usize, usize),
    ) -> Self {
        rerun.hold(knot, operations);
        let (observer, watch) = (experiment.observer(), rerun.watch());
        // It ends with the hold.
        thread::spawn(move || drop(experiment.run_with(&mut rerun)));
        Self { observer, watch }
    }

    /// Reads the graph as it is held.
    pub fn observer(&self) -> &Observer {
        &self.observer
    }

    /// Lets it go on to the first `operations` of the knot.
    pub fn allow(&self, operations: usize) {
        self.watch.allow(operations);
    }

    /// The number of operations done; `None` before all nodes are at rest there.
    pub fn done(&self) -> Option<usize> {
        self.watch.held()
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        self.watch.end();
    }
}

//! Runs with faults in parallel, with an outcome independent of the threads.

use std::{
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
    thread,
};

use super::{
    Hunt, HuntError,
    fault::{FaultPart, Targets},
};
use crate::{
    experiment::{Experiment, Summary},
    system::Verdict,
};

/// The reason for the end of a search.
pub(super) enum Halt {
    /// A request to stop.
    Stopped,
    /// A run failed.
    Failed(HuntError),
}

impl From<HuntError> for Halt {
    fn from(error: HuntError) -> Self {
        Self::Failed(error)
    }
}

/// Runs with faults.
pub(super) struct Trials<'h> {
    hunt: &'h Hunt,
    targets: &'h Targets,
    stop: &'h (dyn Fn() -> bool + Sync),
    runs: usize,
    /// The lists that lost the run, each with its verdict.
    lost: Mutex<Vec<(Vec<FaultPart>, Verdict)>>,
}

impl<'h> Trials<'h> {
    /// Creates the trials of `hunt`, which end when `stop` returns `true`.
    pub fn new(hunt: &'h Hunt, targets: &'h Targets, stop: &'h (dyn Fn() -> bool + Sync)) -> Self {
        Self {
            hunt,
            targets,
            stop,
            runs: 0,
            lost: Mutex::default(),
        }
    }

    /// Number of lists tried. Runs begun in parallel after a list that is enough are not
    /// counted: their number depends on the threads.
    pub fn runs(&self) -> usize {
        self.runs
    }

    /// The summary of the run with the faults of `list`.
    pub fn summary(&self, list: &[FaultPart]) -> Result<Summary, HuntError> {
        let config = self.hunt.with(&self.targets.knobs(list));
        let mut experiment = Experiment::of_resolved(self.hunt.system.clone(), config)?;
        experiment.stop_on(&self.hunt.interrupt);
        Ok(experiment.run()?)
    }

    /// The verdict on the run with the faults of `list`.
    pub fn verdict(&self, list: &[FaultPart]) -> Result<Verdict, HuntError> {
        let lost = self.lost.lock().unwrap_or_else(PoisonError::into_inner);
        match lost.iter().rev().find(|(known, _)| known == list) {
            Some((_, verdict)) => Ok(*verdict),
            None => Ok(self.summary(list)?.verdict),
        }
    }

    /// Whether the run with the faults of `list` is lost; `None` if it was stopped.
    fn is_lost(&self, list: &[FaultPart]) -> Result<Option<bool>, HuntError> {
        let (run, hunt) = (self.summary(list)?, self.hunt);
        if run.is_cut_off(&hunt.interrupt, hunt.base.end) {
            return Ok(None);
        }
        if run.verdict.is_lost() {
            let mut lost = self.lost.lock().unwrap_or_else(PoisonError::into_inner);
            lost.push((list.to_vec(), run.verdict));
        }
        Ok(Some(run.verdict.is_lost()))
    }

    /// The index of the first of `lists` that loses the run.
    pub fn first_lost(&mut self, lists: &[Vec<FaultPart>]) -> Result<Option<usize>, Halt> {
        let (next, first) = (AtomicUsize::new(0), AtomicUsize::new(lists.len()));
        let (stopped, failed) = (AtomicBool::new(false), Mutex::new(Vec::new()));
        let failures = || failed.lock().unwrap_or_else(PoisonError::into_inner);
        let work = || loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            // All lists before the first that is enough are run to their end.
            if index >= first.load(Ordering::Relaxed) {
                return;
            }
            if (self.stop)() || self.hunt.interrupt.is_asked() {
                return stopped.store(true, Ordering::Relaxed);
            }
            match self.is_lost(&lists[index]) {
                Ok(None) => return stopped.store(true, Ordering::Relaxed),
                Ok(Some(false)) => continue,
                Ok(Some(true)) => {}
                Err(error) => failures().push((index, error)),
            }
            first.fetch_min(index, Ordering::Relaxed);
        };
        thread::scope(|scope| {
            for _ in 1..self.hunt.threads.get().min(lists.len()) {
                scope.spawn(work);
            }
            work();
        });
        let first = first.into_inner();
        if stopped.into_inner() {
            return Err(Halt::Stopped);
        }
        let mut failed = failures();
        if let Some(place) = failed.iter().position(|(index, _)| *index == first) {
            return Err(Halt::Failed(failed.swap_remove(place).1));
        }
        drop(failed);
        self.runs += lists.len().min(first + 1);
        Ok((first < lists.len()).then_some(first))
    }
}

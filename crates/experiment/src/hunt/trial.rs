//! Runs with faults in parallel, with an outcome independent of the threads.

use std::ops::ControlFlow;

use super::{Budget, Hunt, HuntError, fault::FaultPart};
use crate::{Experiment, Summary, parallel::in_parallel};
use ratelab_system::Verdict;

/// The reason for the end of a search.
pub(super) enum Halt {
    /// A request to stop.
    Stopped,
    /// A run failed.
    Failed(HuntError),
}

/// Runs with faults.
pub(super) struct Trials<'h> {
    hunt: &'h Hunt,
    budget: &'h Budget,
    stop: &'h (dyn Fn() -> bool + Sync),
    runs: usize,
    /// The lists that were found to lose the run, each with its verdict.
    lost: Vec<(Vec<FaultPart>, Verdict)>,
}

impl<'h> Trials<'h> {
    /// Creates the trials of `hunt`, which end when `stop` returns `true`.
    pub fn new(hunt: &'h Hunt, budget: &'h Budget, stop: &'h (dyn Fn() -> bool + Sync)) -> Self {
        Self {
            hunt,
            budget,
            stop,
            runs: 0,
            lost: Vec::new(),
        }
    }

    /// Returns the number of lists tried. Runs begun in parallel after a list that is enough are not
    /// counted, unless the hunt is stopped: their number depends on the threads.
    pub fn runs(&self) -> usize {
        self.runs
    }

    /// Returns the summary of the run with the faults of `list`; `None` if it was stopped.
    pub fn summary(&self, list: &[FaultPart]) -> Result<Option<Summary>, HuntError> {
        let config = self.hunt.with(&self.budget.knobs(list));
        let experiment = Experiment::from_resolved(self.hunt.system.clone(), config)?;
        Ok(experiment.run_until(&self.hunt.interrupt)?)
    }

    /// Returns the first of the smallest lists within the budget that were found to lose the run,
    /// with its verdict.
    pub fn best(&self) -> Option<&(Vec<FaultPart>, Verdict)> {
        self.lost
            .iter()
            .filter(|(list, _)| self.budget.allows(list))
            .min_by_key(|(list, _)| list.len())
    }

    /// Returns the verdict on a run to its end; `None` if it was stopped.
    fn try_one(&self, list: &[FaultPart]) -> Option<Result<Verdict, HuntError>> {
        if (self.stop)() || self.hunt.interrupt.is_asked() {
            return None;
        }
        let summary = self.summary(list).transpose()?;
        Some(summary.map(|run| run.verdict))
    }

    /// Returns the index of the first of `lists` that loses the run.
    pub fn first_lost(&mut self, lists: &[Vec<FaultPart>]) -> Result<Option<usize>, Halt> {
        let mut first: Option<(usize, Result<Verdict, HuntError>)> = None;
        let mut tried = 0;
        let (threads, trials) = (self.hunt.threads, &*self);
        let run = |index: usize| trials.try_one(&lists[index]);
        // All lists before the first that is enough are run to their end.
        let complete = in_parallel(threads, lists.len(), run, |index, verdict| {
            tried += 1;
            if matches!(&verdict, Ok(verdict) if !verdict.is_lost()) {
                return ControlFlow::Continue(());
            }
            if first.as_ref().is_none_or(|(known, _)| index < *known) {
                first = Some((index, verdict));
            }
            ControlFlow::Break(())
        });
        let index = first.as_ref().map(|(index, _)| *index);
        self.runs += match index {
            _ if !complete => tried,
            Some(index) => index + 1,
            None => lists.len(),
        };
        if let Some((index, verdict)) = first {
            let verdict = verdict.map_err(Halt::Failed)?;
            self.lost.push((lists[index].clone(), verdict));
        }
        if complete {
            Ok(index)
        } else {
            Err(Halt::Stopped)
        }
    }
}

//! Trials of what fixes a run, in the background.

use ratelab::Knob;
use ratelab_experiment::cause::{Trial, Tried};
use ratelab_system::{Setup, WorldKind};

use crate::asked::Asked;

/// A run and the cures that are tried in it.
type CuredRun = (Setup, WorldKind, Vec<Knob>);

/// Trials in the background, one at a time.
pub type CureTrials = Asked<CuredRun, Option<Tried>>;

impl CureTrials {
    /// Returns the outcome of `trial` with `cures`, as far as known; `over` if the run has ended.
    pub fn follow(&mut self, trial: Trial, cures: Vec<Knob>, over: bool) -> Option<&Tried> {
        if cures.is_empty() {
            return None;
        }
        self.receive(false);
        let run = (trial.config().setup.clone(), trial.config().world, cures);
        if !self.is(&run) && !self.is_coming() {
            self.ask(run.clone(), move |(_, _, cures)| trial.run(cures));
        }
        self.receive(over);
        self.answer_to(&run)?.as_ref()
    }
}

#[cfg(test)]
mod tests;

//! Trials of what fixes a run, in the background, and what is said of them.

use ratelab::Knob;
use ratelab_experiment::cause::{CauseLine, Remedy, Trial, Tried};
use ratelab_system::{Setup, WorldKind};

use crate::{asked::Asked, knobs::RATE_KEYS};

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

/// Returns the sentence on a cause; `live` with the keys that turn what helps.
pub fn told(line: CauseLine, live: bool) -> String {
    let text = line.text;
    let advice = line.remedy.and_then(|remedy| match remedy {
        Remedy::Turn(knob, effect) => Some(effect.told(&typed(&knob, live))),
        Remedy::Raise { place, name } if live => {
            Some(format!("{} raises {name}", RATE_KEYS[place]))
        }
        Remedy::Raise { name, .. } => Some(format!("raise {name}")),
        Remedy::OtherMessage => live.then(|| "p takes another".to_owned()),
        Remedy::Known(said) => Some(said),
    });
    match advice {
        Some(advice) => format!("{text}. {advice}"),
        None => text,
    }
}

/// Returns a knob as it is typed: `live` with the key of the prompt.
fn typed(knob: &Knob, live: bool) -> String {
    let key = if live { ":" } else { "" };
    format!("{key}{knob}")
}

#[cfg(test)]
mod tests;

//! Where a robot ceases to stand, as one thing gets worse step by step.

use std::{collections::BTreeMap, num::NonZeroUsize, ops::ControlFlow, sync::Arc};

use ratelab::{Interrupt, Knob};
use ratelab_experiment::{Config, Experiment, parallel::in_parallel};
use ratelab_system::System;

use super::axes::MarginAxis;
use crate::error::Error;

/// The starts that a robot has to survive.
pub struct MarginRuns<'t> {
    /// The robot.
    pub system: &'t Arc<dyn System>,
    /// The configuration of all runs.
    pub config: &'t Config,
    /// Their seeds.
    pub seeds: &'t [u64],
    /// The share of them that has to go well.
    pub share: f64,
    /// Number of threads.
    pub threads: NonZeroUsize,
    /// Ends the work early.
    pub interrupt: &'t Interrupt,
}

/// What came of the runs with one value.
#[derive(Clone, Debug)]
pub struct StandCount {
    /// The runs that went well.
    pub stood: usize,
    /// The verdict that most of the others have, as text.
    pub lost_by: Option<String>,
}

/// The last value that a robot bears, with what it is lost by beyond it.
#[derive(Clone, Debug)]
pub struct Bears {
    /// The number of the value on its axis; `None` where it bears none.
    pub step: Option<u64>,
    /// Whether no value beyond it was looked at.
    pub is_end: bool,
    /// How the next value loses most of its runs.
    pub lost_by: Option<String>,
    /// The runs that went well, by the number of the value.
    pub tried: BTreeMap<u64, usize>,
}

impl MarginRuns<'_> {
    /// Looks for the last step of `axis` that the robot bears: by doubling, then by halving.
    ///
    /// # Errors
    /// [`Error`] of a run, and if it was interrupted.
    pub fn last_borne(&self, axis: &MarginAxis, ran: &dyn Fn()) -> Result<Bears, Error> {
        let mut bears = Bears {
            step: None,
            is_end: false,
            lost_by: None,
            tried: BTreeMap::new(),
        };
        let mut stands = |step: u64| -> Result<bool, Error> {
            let tried = self.run(&axis.knobs(step)?, ran)?;
            bears.tried.insert(step, tried.stood);
            let needed = (self.share * self.seeds.len() as f64).ceil();
            let stands = tried.stood as f64 >= needed;
            if !stands {
                bears.lost_by = tried.lost_by;
            }
            Ok(stands)
        };
        if !stands(0)? {
            return Ok(bears);
        }
        let (mut good, mut bad) = (0, None);
        while bad.is_none() && good < axis.last {
            let next = (2 * good).clamp(1, axis.last);
            if stands(next)? {
                good = next;
            } else {
                bad = Some(next);
            }
        }
        while let Some(worse) = bad.filter(|worse| worse - good > 1) {
            let middle = good + (worse - good) / 2;
            if stands(middle)? {
                good = middle;
            } else {
                bad = Some(middle);
            }
        }
        bears.step = Some(good);
        bears.is_end = bad.is_none();
        Ok(bears)
    }

    /// Runs all seeds with these knobs.
    ///
    /// # Errors
    /// [`Error`] of a run, and if it was interrupted.
    pub fn run(&self, knobs: &[Knob], ran: &dyn Fn()) -> Result<StandCount, Error> {
        let run = |seed: u64| -> Result<Option<(bool, String)>, Error> {
            let mut config = self.config.clone();
            config.seed = seed;
            config.setup.extend(knobs.iter().cloned());
            let experiment = Experiment::from_resolved(self.system.clone(), config)?;
            let summary = experiment.run_until(self.interrupt)?;
            let end = |verdict: &ratelab_system::Verdict| {
                (!verdict.is_lost(), cause(&verdict.kind.text).to_owned())
            };
            Ok(summary.map(|summary| end(&summary.verdict)))
        };
        let mut runs = BTreeMap::new();
        let work = |index: usize| run(self.seeds[index]).transpose();
        in_parallel(self.threads, self.seeds.len(), work, |index, outcome| {
            ran();
            runs.insert(index, outcome);
            ControlFlow::Continue(())
        });
        let runs: Vec<(bool, String)> = runs.into_values().collect::<Result<_, Error>>()?;
        Error::if_stopped(runs.len(), self.seeds.len(), "runs")?;
        let mut causes: BTreeMap<String, usize> = BTreeMap::new();
        for (_, cause) in runs.iter().filter(|(stood, _)| !stood) {
            *causes.entry(cause.clone()).or_default() += 1;
        }
        let most = causes.into_iter().max_by_key(|(_, count)| *count);
        Ok(StandCount {
            stood: runs.iter().filter(|(stood, _)| *stood).count(),
            lost_by: most.map(|(cause, _)| cause),
        })
    }
}

/// Returns what the text of a verdict has in brackets, or else the text.
fn cause(text: &str) -> &str {
    let inside = text
        .split_once('(')
        .and_then(|(_, rest)| rest.strip_suffix(')'));
    inside.unwrap_or(text)
}

//! A run at other phases of its nodes, and how its age differs.

use std::{collections::BTreeMap, ops::ControlFlow};

use ratelab::{ClockKind, Interrupt, millis};
use ratelab_experiment::{
    Experiment,
    sweep::{Sweep, all_cores},
};
use serde::Serialize;

use super::rounded;
use crate::error::Error;

/// The verdict on a run without data in a chain that has no limit.
const NO_DATA: &str = "no_data";

/// What the runs at other phases came to.
pub struct PhaseSpread {
    seed: u64,
    runs: usize,
    /// The number of runs that were asked for.
    asked: usize,
    /// The mean push ages (ms), in ascending order.
    ages: Vec<f64>,
    /// The number of runs with each verdict.
    verdicts: BTreeMap<String, usize>,
    /// The knobs of the worst run: a lost one, or else the oldest.
    worst: Vec<String>,
}

/// Returns `count` runs of `experiment`, each at other phases.
///
/// # Errors
/// [`Error::BadInput`] for a run on the real clock, where phases are as they come.
pub fn phase_sweep(experiment: &Experiment, count: usize) -> Result<Sweep, Error> {
    let config = experiment.config().clone();
    if config.clock == ClockKind::Real {
        let why = "--phases shifts nodes in virtual time: add --clock virtual";
        return Err(Error::BadInput(why.to_owned()));
    }
    Ok(Sweep {
        axes: vec![experiment.phases(count)],
        ..Sweep::new(experiment.system().clone(), config)
    })
}

impl PhaseSpread {
    /// Runs `sweep` on all cores, until `interrupt` is asked for.
    ///
    /// # Errors
    /// [`Error::Sweep`] if a run failed.
    pub fn measure(sweep: &Sweep, interrupt: &Interrupt) -> Result<Self, Error> {
        let swept = sweep.run_until(interrupt, all_cores(), |_, _| ControlFlow::Continue(()))?;
        let (mut ages, mut verdicts) = (Vec::new(), BTreeMap::new());
        let mut worst = (false, f64::NEG_INFINITY, Vec::new());
        for (cell, result) in swept.finished() {
            let age = result.push_age.map(|age| age.run_s * 1e3);
            let name = match result.without_data {
                Some(_) if !result.verdict.is_lost() => NO_DATA,
                _ => result.verdict.name(),
            };
            *verdicts.entry(name.to_owned()).or_default() += 1;
            ages.extend(age);
            let (lost, age) = (result.is_lost(), age.unwrap_or(0.0));
            if (lost, age) > (worst.0, worst.1) {
                let knobs = cell.values.iter().flat_map(|value| &value.knobs);
                worst = (lost, age, knobs.map(ToString::to_string).collect());
            }
        }
        ages.sort_by(f64::total_cmp);
        Ok(Self {
            seed: sweep.base.seed,
            runs: verdicts.values().sum(),
            asked: sweep.cells()?,
            ages,
            verdicts,
            worst: worst.2,
        })
    }

    /// Least, median and greatest of the mean push ages (ms); `None` without a push.
    fn spread(&self) -> Option<[f64; 3]> {
        let ages = &self.ages;
        Some([*ages.first()?, ages[ages.len() / 2], *ages.last()?])
    }

    /// Returns an error if a stop was asked for before the last run.
    pub fn if_stopped(&self) -> Result<(), Error> {
        Error::if_stopped(self.runs, self.asked, "runs at other phases")
    }

    /// Returns lines for people.
    pub fn lines(&self) -> Vec<(&'static str, String)> {
        let mut text = format!("{} by seed {}", self.runs, self.seed);
        if let Some([least, median, greatest]) = self.spread() {
            let [least, median, greatest] = [least, median, greatest].map(millis::text);
            text += &format!(": mean push age {least} to {greatest} ms, median {median} ms");
        }
        for (name, count) in &self.verdicts {
            text += &format!("; {} {count}", name.replace('_', " "));
        }
        let mut lines = vec![("phases", text), ("worst", self.worst.join(" | "))];
        lines.retain(|(_, text)| !text.is_empty());
        lines
    }

    /// Returns the spread, for programs.
    pub fn figures(&self) -> PhaseFigures<'_> {
        let ages = self.spread().map(|ages| ages.map(rounded));
        PhaseFigures {
            runs: self.runs,
            mean_push_age_ms: ages.map(|[min, median, max]| SpreadFigures { min, median, max }),
            verdicts: &self.verdicts,
            worst: &self.worst,
        }
    }
}

/// The spread over phases, for programs.
#[derive(Serialize)]
pub struct PhaseFigures<'a> {
    runs: usize,
    mean_push_age_ms: Option<SpreadFigures>,
    verdicts: &'a BTreeMap<String, usize>,
    worst: &'a [String],
}

#[derive(Serialize)]
struct SpreadFigures {
    min: f64,
    median: f64,
    max: f64,
}

//! A run at other phases of its nodes: how the age differs.

use std::collections::BTreeMap;

use ratelab::ClockKind;
use ratelab_study::experiment::{
    Experiment,
    sweep::{Sweep, Swept, all_cores},
};
use serde_json::{Value, json};

use super::rounded;
use crate::error::Error;

/// The runs.
pub struct Phases(Sweep);

/// What they have come to.
pub struct PhaseSpread {
    seed: u64,
    runs: usize,
    /// The mean push ages (ms), in ascending order.
    ages: Vec<f64>,
    /// The number of runs with each verdict.
    verdicts: BTreeMap<&'static str, usize>,
    /// The knobs of the worst run: a lost one, or else the oldest.
    worst: Vec<String>,
}

impl Phases {
    /// `count` runs of `experiment`.
    ///
    /// # Errors
    /// [`Error::BadInput`] for a run on the real clock, where phases are as they come.
    pub fn of(experiment: &Experiment, count: usize) -> Result<Self, Error> {
        let config = experiment.config().clone();
        if config.clock == ClockKind::Real {
            let why = "--phases shifts nodes in virtual time: add --clock virtual";
            return Err(Error::BadInput(why.to_owned()));
        }
        let axes = vec![experiment.phases(count)];
        let sweep = Sweep::of(experiment.system().clone(), config);
        Ok(Self(Sweep { axes, ..sweep }))
    }

    /// Runs them, on all cores.
    ///
    /// # Errors
    /// [`Error::Sweep`] if a run failed.
    pub fn run(self) -> Result<PhaseSpread, Error> {
        let swept = self
            .0
            .run(all_cores(), |_, _| std::ops::ControlFlow::Continue(()))?;
        Ok(PhaseSpread::of(&swept))
    }
}

impl PhaseSpread {
    fn of(swept: &Swept) -> Self {
        let (mut ages, mut verdicts) = (Vec::new(), BTreeMap::new());
        let mut worst = (false, f64::NEG_INFINITY, Vec::new());
        for (cell, result) in swept.finished() {
            let age = result.push_age.map(|age| age.run_s * 1e3);
            *verdicts.entry(result.verdict.name()).or_default() += 1;
            ages.extend(age);
            let (lost, age) = (result.verdict.is_lost(), age.unwrap_or(0.0));
            if (lost, age) > (worst.0, worst.1) {
                let knobs = cell.values.iter().flat_map(|value| &value.knobs);
                worst = (lost, age, knobs.map(ToString::to_string).collect());
            }
        }
        ages.sort_by(f64::total_cmp);
        Self {
            seed: swept.sweep().base.seed,
            runs: verdicts.values().sum(),
            ages,
            verdicts,
            worst: worst.2,
        }
    }

    /// Least, median and greatest of the mean push ages (ms); `None` without a push.
    fn spread(&self) -> Option<[f64; 3]> {
        let ages = &self.ages;
        Some([*ages.first()?, ages[ages.len() / 2], *ages.last()?])
    }

    /// Lines for people.
    pub fn lines(&self) -> impl Iterator<Item = (&'static str, String)> + use<> {
        let age = self
            .spread()
            .map_or_else(String::new, |[least, median, greatest]| {
                format!(": mean push age {least:.1} to {greatest:.1} ms, median {median:.1} ms")
            });
        let verdicts = self.verdicts.iter();
        let verdicts =
            verdicts.map(|(name, count)| format!("; {} {count}", name.replace('_', " ")));
        let verdicts: String = verdicts.collect();
        [
            (
                "phases",
                format!("{} by seed {}{age}{verdicts}", self.runs, self.seed),
            ),
            ("worst", self.worst.join(" | ")),
        ]
        .into_iter()
        .filter(|(_, text)| !text.is_empty())
    }

    /// The same for programs.
    pub fn json(&self) -> Value {
        let ages = self.spread().map(|ages| ages.map(rounded));
        json!({
            "runs": self.runs,
            "mean_push_age_ms": ages.map(|[min, median, max]| {
                json!({ "min": min, "median": median, "max": max })
            }),
            "verdicts": self.verdicts,
            "worst": self.worst,
        })
    }
}

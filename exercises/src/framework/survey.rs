//! One knob with several values, each from the same starts.

use std::ops::ControlFlow;

use ratelab_study::experiment::{
    Config,
    sweep::{CellResult, Sweep, all_cores},
};

use super::{Failure, axis, cart_pole};

/// The runs with one value of the knob.
pub(crate) struct KnobRuns {
    /// The value.
    pub(crate) value: String,
    /// The results, by start.
    pub(crate) runs: Vec<CellResult>,
}

impl KnobRuns {
    /// Number of runs with the pole up at the end.
    pub(crate) fn up(&self) -> usize {
        self.runs
            .iter()
            .filter(|run| !run.verdict.is_lost())
            .count()
    }

    /// Whether the pole was up at the end of all runs.
    pub(crate) fn all_up(&self) -> bool {
        self.up() == self.runs.len()
    }

    /// The mean push age of the last second (ms), over all runs.
    pub(crate) fn push_age_ms(&self) -> f64 {
        push_age_ms(self.runs.iter())
    }

    /// Such as `3 of 20`.
    pub(crate) fn up_of(&self) -> String {
        format!("{} of {}", self.up(), self.runs.len())
    }
}

/// The mean push age of the last second (ms), over `runs`; NaN without one.
pub(crate) fn push_age_ms<'r>(runs: impl Iterator<Item = &'r CellResult>) -> f64 {
    let ages: Vec<f64> = runs
        .filter_map(|run| Some(run.push_age?.late_s * 1e3))
        .collect();
    ages.iter().sum::<f64>() / ages.len() as f64
}

/// Runs `base` with each of `values` of `knob`, from the starts of `seeds`.
pub(crate) fn survey<T: ToString>(
    base: Config,
    knob: &str,
    values: &[T],
    seeds: std::ops::Range<u64>,
) -> Result<Vec<KnobRuns>, Failure> {
    let sweep = Sweep {
        axes: vec![axis(knob, values)?],
        seeds: seeds.collect(),
        ..Sweep::of(cart_pole(), base)
    };
    let starts = sweep.seeds.len();
    let swept = sweep.run(all_cores(), |_, _| ControlFlow::Continue(()))?;
    let results: Vec<CellResult> = swept.finished().map(|(_, run)| run.clone()).collect();
    let groups = values.iter().zip(results.chunks(starts));
    let groups = groups.map(|(value, runs)| KnobRuns {
        value: value.to_string(),
        runs: runs.to_vec(),
    });
    Ok(groups.collect())
}

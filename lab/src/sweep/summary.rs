//! The runs of a sweep together, for everything but the seed.

use ratelab::experiment::sweep::{Cell, CellResult, Sweep, Swept};

use super::{
    columns::{self, Column},
    theory::Theory,
};
use crate::{error::Error, names};

/// All rows of a sweep, and how much of it was done.
pub struct SweepSummary {
    /// What was swept.
    pub sweep: Sweep,
    /// What changes fastest.
    pub main: Column,
    /// A word for runs that are not lost.
    pub good: String,
    /// In the order of the sweep.
    rows: Vec<RowSummary>,
    /// Runs that were made.
    pub runs: usize,
    /// Runs that were to be made.
    pub cells: usize,
}

/// The runs of one combination of knobs, over all seeds.
#[derive(Clone, Debug)]
pub struct RowSummary {
    /// The first of them; the others differ in the seed.
    pub cell: Cell,
    /// The value of what changes fastest, in short.
    pub value: String,
    /// Runs that were made.
    pub runs: usize,
    /// Runs that were not lost.
    pub held: usize,
    /// Mean over the runs of their mean latency (s).
    pub mean_latency_s: Option<f64>,
    /// The median run time at which it was lost (s); `None` if it never was.
    pub lost_at_s: Option<f64>,
    /// The growth of a small deviation by linear theory (1/s).
    pub growth: Option<f64>,
}

impl SweepSummary {
    /// Of what was swept; with the growth by linear theory, if it is `wanted`.
    ///
    /// # Errors
    /// [`Error`] if there is none, or nothing was swept.
    pub fn of(swept: &Swept, wanted: bool) -> Result<Self, Error> {
        let sweep = swept.sweep();
        let main = columns::main(sweep);
        let main = main.ok_or_else(|| Error::BadInput("nothing is swept".to_owned()))?;
        let (mut finished, mut theory) = (swept.finished(), Theory::default());
        let rows = swept.survival().map(|survival| {
            let group = finished.by_ref().take(survival.runs);
            let outcomes: Vec<&CellResult> = group.map(|(_, outcome)| outcome).collect();
            let lost = outcomes.iter().filter(|o| o.verdict.is_lost());
            let setup = sweep.config(&survival.cell).setup;
            Ok(RowSummary {
                value: main.short(sweep, &survival.cell),
                runs: survival.runs,
                held: survival.held,
                mean_latency_s: mean(outcomes.iter().filter_map(|o| o.mean_latency_s)),
                lost_at_s: median(lost.map(|o| o.sim_time.as_secs_f64())),
                growth: wanted.then(|| theory.growth(&setup)).transpose()?.flatten(),
                cell: survival.cell,
            })
        });
        let rows = rows.collect::<Result<Vec<RowSummary>, Error>>()?;
        Ok(Self {
            runs: rows.iter().map(|row| row.runs).sum(),
            cells: sweep.cells().unwrap_or(0),
            good: names::good(&*sweep.system),
            sweep: sweep.clone(),
            main,
            rows,
        })
    }

    /// All rows.
    pub fn rows(&self) -> &[RowSummary] {
        &self.rows
    }

    /// The rows that differ in what changes fastest only.
    pub fn groups(&self) -> impl ExactSizeIterator<Item = &[RowSummary]> {
        self.rows.chunks(self.main.count(&self.sweep).max(1))
    }
}

impl RowSummary {
    /// The value of what changes fastest, if it is a number.
    pub fn number(&self) -> f64 {
        self.value.parse().unwrap_or(f64::NAN)
    }

    /// Runs that were not lost as a share of all; `None` if none was made.
    pub fn share(&self) -> Option<f64> {
        (self.runs > 0).then(|| self.held as f64 / self.runs as f64)
    }
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let values: Vec<f64> = values.collect();
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// The lower of the two in the middle, where there are two.
fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let middle = values.len().checked_sub(1)? / 2;
    values.get(middle).copied()
}

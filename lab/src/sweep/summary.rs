//! What the runs of a sweep came to together, for everything but the seed.

use ratelab::experiment::sweep::{Cell, CellResult, Sweep, Swept};

use super::theory::Theory;

/// All rows of a sweep, and how much of it was done.
pub struct SweepSummary {
    /// What was swept.
    pub sweep: Sweep,
    /// In the order of the sweep: the control rate changes fastest.
    rows: Vec<RateSummary>,
    /// Runs that were made.
    pub runs: usize,
    /// Runs that were to be made.
    pub cells: usize,
}

/// The runs of one control rate under the same conditions, over all seeds.
#[derive(Clone, Debug)]
pub struct RateSummary {
    /// The first of them; the others differ in the seed.
    pub cell: Cell,
    /// Runs that were made.
    pub runs: usize,
    /// Runs whose pole was up to the end.
    pub balanced: usize,
    /// Mean over the runs of their mean sense→act latency (s).
    pub mean_latency_s: Option<f64>,
    /// The median run time at which it was lost (s); `None` if it never was.
    pub lost_at_s: Option<f64>,
    /// The growth of a small deviation by linear theory (1/s).
    pub growth: Option<f64>,
}

impl SweepSummary {
    /// Of what was swept, with what `theory` says beside it.
    pub fn of(swept: &Swept, theory: &Theory) -> Self {
        let mut finished = swept.finished();
        let rows = swept.survival().map(|survival| {
            let group = finished.by_ref().take(survival.runs);
            let outcomes: Vec<&CellResult> = group.map(|(_, outcome)| outcome).collect();
            let lost = outcomes.iter().filter(|o| !o.verdict.balanced());
            RateSummary {
                runs: survival.runs,
                balanced: survival.balanced,
                mean_latency_s: mean(outcomes.iter().filter_map(|o| o.mean_latency_s)),
                lost_at_s: median(lost.map(|o| o.sim_time.as_secs_f64())),
                growth: theory.growth(&survival.cell),
                cell: survival.cell,
            }
        });
        let rows: Vec<RateSummary> = rows.collect();
        Self {
            runs: rows.iter().map(|row| row.runs).sum(),
            cells: swept.sweep().cells().unwrap_or(0),
            sweep: swept.sweep().clone(),
            rows,
        }
    }

    /// All rows.
    pub fn rows(&self) -> &[RateSummary] {
        &self.rows
    }

    /// The rows under the same conditions, one per control rate.
    pub fn groups(&self) -> impl ExactSizeIterator<Item = &[RateSummary]> {
        self.rows.chunks(self.sweep.control_hz.len().max(1))
    }
}

impl RateSummary {
    /// Balanced runs as a share of all; `None` if none was made.
    pub fn share(&self) -> Option<f64> {
        (self.runs > 0).then(|| self.balanced as f64 / self.runs as f64)
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

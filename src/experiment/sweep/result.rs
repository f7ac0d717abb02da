//! What the cells of a sweep came to.

use super::{Cell, Sweep};
use crate::{
    experiment::{Summary, Verdict},
    runtime::Time,
};

/// What one cell came to: of a [`Summary`] what a map or a table shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellResult {
    /// How the run ended.
    pub verdict: Verdict,
    /// Control steps that the plant made.
    pub steps: u64,
    /// Run time at the end.
    pub sim_time: Time,
    /// Mean sense→act latency (s); `None` if no action arrived.
    pub mean_latency_s: Option<f64>,
    /// Messages lost unread on `/obs`.
    pub obs_dropped: u64,
    /// Messages lost unread on `/action`.
    pub action_dropped: u64,
    /// The pole's angle at the end (rad).
    pub final_pole_angle: f64,
}

impl From<&Summary> for CellResult {
    fn from(summary: &Summary) -> Self {
        Self {
            verdict: summary.verdict,
            steps: summary.steps,
            sim_time: summary.sim_time,
            mean_latency_s: summary.latency.mean_s(),
            obs_dropped: summary.obs.dropped,
            action_dropped: summary.action.dropped,
            final_pole_angle: summary.final_pole_angle,
        }
    }
}

/// A sweep and what came of it, all of it or as far as it went.
#[derive(Clone, Debug)]
pub struct Swept {
    pub(super) sweep: Sweep,
    pub(super) outcomes: Vec<Option<CellResult>>,
}

impl Swept {
    /// What was swept.
    pub fn sweep(&self) -> &Sweep {
        &self.sweep
    }

    /// The cells that were run, in the order of the sweep.
    pub fn finished(&self) -> impl Iterator<Item = (Cell, &CellResult)> {
        let outcomes = self.outcomes.iter().enumerate();
        outcomes.filter_map(|(index, outcome)| Some((self.sweep.cell(index)?, outcome.as_ref()?)))
    }

    /// Whether no cell was left out.
    pub fn is_complete(&self) -> bool {
        self.outcomes.iter().all(Option::is_some)
    }

    /// How often the pole stayed up, for everything but the seed: in the order
    /// of the sweep, one figure for all seeds.
    pub fn survival(&self) -> impl Iterator<Item = Survival> {
        let seeds = self.sweep.seeds.len().max(1);
        let groups = self.outcomes.chunks(seeds).enumerate();
        groups.filter_map(move |(group, outcomes)| {
            let finished = outcomes.iter().flatten();
            Some(Survival {
                cell: self.sweep.cell(group * seeds)?,
                runs: finished.clone().count(),
                balanced: finished.filter(|o| o.verdict.balanced()).count(),
            })
        })
    }
}

/// How often the pole stayed up over the seeds of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct Survival {
    /// The first of the cells that were counted; the others differ in the seed.
    pub cell: Cell,
    /// Runs that were made.
    pub runs: usize,
    /// Runs whose pole was up to the end.
    pub balanced: usize,
}

impl Survival {
    /// Balanced runs as a share of all; `None` if none was made.
    pub fn share(&self) -> Option<f64> {
        (self.runs > 0).then(|| self.balanced as f64 / self.runs as f64)
    }
}

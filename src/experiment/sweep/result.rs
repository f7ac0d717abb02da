//! The results of a sweep's cells.

use super::{Cell, Sweep};
use crate::{experiment::Summary, runtime::Time, system::Verdict};

/// The result of one cell: of a [`Summary`] what a map or a table shows.
#[derive(Clone, Debug, PartialEq)]
pub struct CellResult {
    /// The verdict of the run.
    pub verdict: Verdict,
    /// Steps of the plant.
    pub steps: u64,
    /// Run time at the end.
    pub sim_time: Time,
    /// Mean of the latency that matters (s); `None` if it was never measured.
    pub mean_latency_s: Option<f64>,
    /// Messages lost unread, for each topic that a node reads.
    pub dropped: Vec<u64>,
    /// The newest state of the plant.
    pub state: Box<[f64]>,
}

impl From<&Summary> for CellResult {
    fn from(summary: &Summary) -> Self {
        let read = summary.topics.iter().filter(|topic| topic.read);
        Self {
            verdict: summary.verdict,
            steps: summary.steps,
            sim_time: summary.sim_time,
            mean_latency_s: summary.latency.mean_s(),
            dropped: read.map(|topic| topic.dropped).collect(),
            state: summary.state.clone().into(),
        }
    }
}

/// A sweep and its results, all of them or as far as it went.
#[derive(Clone)]
pub struct Swept {
    pub(super) sweep: Sweep,
    pub(super) outcomes: Vec<Option<CellResult>>,
}

impl Swept {
    /// The sweep.
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

    /// How often a run was not lost, for everything but the seed: in the order
    /// of the sweep, one figure for all seeds.
    pub fn survival(&self) -> impl Iterator<Item = Survival> {
        let seeds = self.sweep.seeds.len().max(1);
        let groups = self.outcomes.chunks(seeds).enumerate();
        groups.filter_map(move |(group, outcomes)| {
            let finished = outcomes.iter().flatten();
            Some(Survival {
                cell: self.sweep.cell(group * seeds)?,
                runs: finished.clone().count(),
                held: finished.filter(|result| !result.verdict.is_lost()).count(),
            })
        })
    }
}

/// How often a run was not lost, over the seeds of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct Survival {
    /// The first of the cells that were counted; the others differ in the seed.
    pub cell: Cell,
    /// Runs that were made.
    pub runs: usize,
    /// Runs that were not lost.
    pub held: usize,
}

impl Survival {
    /// Runs that were not lost as a share of all; `None` if none was made.
    pub fn share(&self) -> Option<f64> {
        (self.runs > 0).then(|| self.held as f64 / self.runs as f64)
    }
}

//! The results of a sweep's cells.

use ratelab::Time;

use super::{Cell, Sweep};
use crate::{MeanPushAge, RunAge, Summary};
use ratelab_system::{System, SystemFigure, Verdict};

/// The result of one cell: the part of a [`Summary`] for maps and tables.
#[derive(Clone, Debug, PartialEq)]
pub struct CellResult {
    /// Verdict on the run.
    pub verdict: Verdict,
    /// Steps of the plant.
    pub steps: u64,
    /// Run time at the end.
    pub sim_time: Time,
    /// Mean of the main latency (s); `None` without samples.
    pub mean_latency_s: Option<f64>,
    /// How old what was done to the world was; `None` if nothing was done.
    pub push_age: Option<MeanPushAge>,
    /// The ages of the run with their parts, if the sweep is to have them.
    pub ages: Box<[RunAge]>,
    /// The mean of the system's quadratic cost; of a run that was lost, until then.
    pub cost: Option<f64>,
    /// The system's own figures.
    pub figures: Box<[SystemFigure]>,
    /// Messages lost unread, for each topic with readers.
    pub dropped: Vec<u64>,
    /// The last state of the plant.
    pub state: Box<[f64]>,
    /// The first chain through which no data came, with the reason.
    pub without_data: Option<Box<str>>,
}

impl CellResult {
    /// Creates the result of a run of `system`.
    pub fn new(system: &dyn System, summary: &Summary) -> Self {
        let without_data = summary.without_data(system).into_iter().next();
        Self {
            without_data: without_data.map(String::into_boxed_str),
            ..Self::from(summary)
        }
    }

    /// Returns whether the run is lost. A chain without data is not kept, whether it has a limit or
    /// not.
    pub fn is_lost(&self) -> bool {
        self.verdict.is_lost() || self.without_data.is_some()
    }
}

impl From<&Summary> for CellResult {
    fn from(summary: &Summary) -> Self {
        let read = summary.topics.iter().filter(|topic| topic.is_read());
        Self {
            verdict: summary.verdict.clone(),
            steps: summary.steps,
            sim_time: summary.sim_time,
            mean_latency_s: summary.latency.mean_s(),
            push_age: summary.push_age(),
            ages: summary.ages.clone().into(),
            cost: summary.cost,
            figures: summary.figures.clone().into(),
            dropped: read.map(|topic| topic.dropped()).collect(),
            state: summary.state.clone().into(),
            without_data: None,
        }
    }
}

/// A sweep with the results of its finished cells.
#[derive(Clone)]
pub struct Swept {
    pub(super) sweep: Sweep,
    pub(super) outcomes: Vec<Option<CellResult>>,
}

impl Swept {
    /// Returns the sweep.
    pub fn sweep(&self) -> &Sweep {
        &self.sweep
    }

    /// Returns the finished cells, in the order of the sweep.
    pub fn finished(&self) -> impl Iterator<Item = (Cell, &CellResult)> {
        self.outcomes
            .iter()
            .enumerate()
            .filter_map(|(index, outcome)| Some((self.sweep.cell(index)?, outcome.as_ref()?)))
    }

    /// Returns whether all cells are finished.
    pub fn is_complete(&self) -> bool {
        self.outcomes.iter().all(Option::is_some)
    }

    /// Returns the survival for each combination of knobs, over all seeds, in the order of the
    /// sweep.
    pub fn survival(&self) -> impl Iterator<Item = Survival> {
        let seeds = self.sweep.seeds.len().max(1);
        self.outcomes
            .chunks(seeds)
            .enumerate()
            .filter_map(move |(group, outcomes)| {
                let finished = outcomes.iter().flatten();
                Some(Survival {
                    cell: self.sweep.cell(group * seeds)?,
                    runs: finished.clone().count(),
                    held: finished.filter(|result| !result.is_lost()).count(),
                })
            })
    }
}

/// The number of successful runs over the seeds of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct Survival {
    /// The first of the counted cells; the others differ only in the seed.
    pub cell: Cell,
    /// Finished runs.
    pub runs: usize,
    /// Runs that were not lost.
    pub held: usize,
}

impl Survival {
    /// Share of runs that were not lost; `None` without runs.
    pub fn share(&self) -> Option<f64> {
        (self.runs > 0).then(|| self.held as f64 / self.runs as f64)
    }
}

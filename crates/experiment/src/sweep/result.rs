//! The results of a sweep's cells, and the share of runs held, by the age of the sensing behind
//! their actions.

use ratelab::Time;
use ratelab_system::{System, SystemFigure, Verdict};

use super::{Cell, Sweep};
use crate::{MeanPushAge, RunAge, Summary};

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
            without_data: without_data.map(String::into_boxed_str),
        }
    }

    /// Returns whether the run is lost. A chain without data is not kept, whether it has a limit or
    /// not.
    pub fn is_lost(&self) -> bool {
        self.verdict.is_lost() || self.without_data.is_some()
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

/// Runs by age, for any cause of the age.
///
/// The age of a run is its mean push age over its last second; of a lost run, over the
/// last second before the loss.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ByAge {
    /// Ages (s), rounded to 0.1 ms, and whether the run was held; ascending.
    runs: Vec<(f64, bool)>,
}

/// The runs within a range of ages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AgeBin {
    /// Lower bound, inclusive (s).
    pub from_s: f64,
    /// Upper bound, exclusive (s).
    pub to_s: f64,
    /// Number of runs.
    pub runs: usize,
    /// Number of runs held.
    pub held: usize,
}

/// The age that best separates lost runs from held ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AgeSplit {
    /// The age (s).
    pub at_s: f64,
    /// Number of runs on the wrong side of it: held above, lost below.
    pub misjudged: usize,
}

impl ByAge {
    /// Sorts `results` by age. Runs without a push have no age and are left out.
    pub fn new<'r>(results: impl IntoIterator<Item = &'r CellResult>) -> Self {
        let runs = results.into_iter().filter_map(|result| {
            let age = result.push_age?;
            Some((age.late_s, !result.is_lost()))
        });
        runs.collect()
    }

    /// Returns the age (s) of each run, and whether it was held; ascending.
    pub fn runs(&self) -> impl Iterator<Item = (f64, bool)> {
        self.runs.iter().copied()
    }

    /// Returns the number of runs.
    pub fn len(&self) -> usize {
        self.runs.len()
    }

    /// Returns whether there are no runs.
    pub fn is_empty(&self) -> bool {
        self.runs.is_empty()
    }

    /// Returns the smallest age of a lost run (s).
    pub fn youngest_lost_s(&self) -> Option<f64> {
        self.runs
            .iter()
            .find(|(_, held)| !held)
            .map(|(age, _)| *age)
    }

    /// Returns the largest age of a held run (s).
    pub fn oldest_held_s(&self) -> Option<f64> {
        self.runs
            .iter()
            .rev()
            .find(|(_, held)| *held)
            .map(|(age, _)| *age)
    }

    /// Returns the runs in bins `width_s` wide, without empty bins.
    pub fn bins(&self, width_s: f64) -> Vec<AgeBin> {
        // Ages are rounded, their quotients are not.
        let number = |age: f64| (age / width_s + 1e-6).floor();
        let same = |one: &(f64, bool), next: &(f64, bool)| number(one.0) == number(next.0);
        let bins = self.runs.chunk_by(same).map(|runs| {
            let first = number(runs[0].0);
            AgeBin {
                from_s: first * width_s,
                to_s: (first + 1.0) * width_s,
                runs: runs.len(),
                held: runs.iter().filter(|(_, held)| *held).count(),
            }
        });
        bins.collect()
    }

    /// Returns the age with the fewest runs on its wrong side: the midpoint between two runs, the
    /// smallest of several. `None` if all runs were lost, or all were held.
    pub fn split(&self) -> Option<AgeSplit> {
        self.youngest_lost_s().zip(self.oldest_held_s())?;
        let held = self.runs.iter().filter(|(_, held)| *held).count();
        // First for a limit below all runs, then above one more run at a time.
        let (mut misjudged, mut best) = (held, None::<AgeSplit>);
        for pair in self.runs.windows(2) {
            let ((younger, was_held), (older, _)) = (pair[0], pair[1]);
            misjudged = if was_held {
                misjudged - 1
            } else {
                misjudged + 1
            };
            let at_s = f64::midpoint(younger, older);
            if older > younger && best.is_none_or(|best| misjudged < best.misjudged) {
                best = Some(AgeSplit { at_s, misjudged });
            }
        }
        best
    }

    /// Returns the number of runs on the wrong side of the age `at_s`.
    pub fn misjudged_at(&self, at_s: f64) -> usize {
        let wrong = |(age, held): &&(f64, bool)| *held == (*age >= at_s);
        self.runs.iter().filter(wrong).count()
    }
}

impl FromIterator<(f64, bool)> for ByAge {
    /// From ages (s), and whether each run was held.
    fn from_iter<I: IntoIterator<Item = (f64, bool)>>(runs: I) -> Self {
        let runs = runs.into_iter();
        let mut runs: Vec<(f64, bool)> = runs.map(|(age, held)| (rounded(age), held)).collect();
        runs.sort_by(|one, other| one.0.total_cmp(&other.0));
        Self { runs }
    }
}

/// Rounds to 0.1 ms: smaller digits depend on the order of summation.
fn rounded(seconds: f64) -> f64 {
    (seconds * 1e4).round() / 1e4
}

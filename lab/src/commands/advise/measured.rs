//! What a run with a change is measured by: an age, or the periods that its nodes skip.

use std::time::Duration;

use ratelab_experiment::{Summary, advise::AgeChange};

/// The share of a score below which a change helps.
const HELPS: f64 = 0.99;

/// A run with a change, or without any.
pub struct ChangedRun {
    pub change: AgeChange,
    pub summary: Summary,
    pub score: Score,
    /// The share of the time within its limit, if any.
    pub within: Option<f64>,
    /// The same in words.
    pub within_text: Option<String>,
}

/// What is to become less.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Score {
    /// An age over run time (ns).
    Age { mean_ns: i64, p99_ns: i64 },
    /// Skipped periods of all nodes, of the due ones, and the mean lateness of their ticks.
    Overruns {
        skipped: u64,
        due: u64,
        lateness: Duration,
    },
}

impl Score {
    /// Creates the skipped periods in a run.
    pub fn overruns(summary: &Summary) -> Self {
        let nodes = || summary.nodes.iter();
        let skipped = nodes()
            .map(|node| node.overruns)
            .fold(0, u64::saturating_add);
        let timed = nodes().filter(|node| node.triggers.is_empty());
        let ticks = timed.map(|node| node.ticks).fold(0, u64::saturating_add);
        let late: Duration = nodes().map(|node| node.lateness.sum()).sum();
        let count = nodes().map(|node| node.lateness.count()).sum::<u64>();
        let count = u32::try_from(count).unwrap_or(u32::MAX).max(1);
        Self::Overruns {
            skipped,
            due: ticks.saturating_add(skipped),
            lateness: late / count,
        }
    }

    /// Returns what the best run has least of: first the score itself, then what it costs.
    pub fn rank(self) -> [u64; 2] {
        match self {
            Self::Age { mean_ns, .. } => [mean_ns.max(0).unsigned_abs(), 0],
            Self::Overruns {
                skipped, lateness, ..
            } => [skipped, lateness.as_nanos() as u64],
        }
    }
}

impl ChangedRun {
    /// Returns whether its score is clearly smaller than in the `other` run.
    pub fn is_better(&self, other: &Self) -> bool {
        let [mine, others] = [self, other].map(|run| run.score.rank()[0]);
        mine < others && mine as f64 <= HELPS * others as f64
    }
}

//! What a recorder is given: a run to look at, and in the end why to stop.

use ratelab::{
    experiment::{Config, Experiment, Summary, Taps},
    runtime::{Fault, Observer, Snapshot, telemetry::TopicView},
};

use super::schema::{Origin, RunStatus};

/// A run as a recorder sees it.
#[derive(Clone)]
pub struct Source {
    /// What is run.
    pub origin: Origin,
    /// The graph before the run.
    pub start: Snapshot,
    /// Reads the graph.
    pub observer: Observer,
    /// Taps it.
    pub taps: Taps,
}

impl Source {
    /// An experiment that has not begun, made from `config`.
    pub fn of(experiment: &Experiment, config: &Config) -> Self {
        let observer = experiment.observer();
        Self {
            origin: Origin::new(config.clone(), observer.topology()),
            start: observer.snapshot(),
            taps: experiment.taps(),
            observer,
        }
    }
}

/// Why a recorder is to stop.
pub enum StopReason {
    /// The run ended.
    Run(Box<Summary>),
    /// A node failed.
    Fault(String),
    /// The run goes on without it.
    Off,
}

impl StopReason {
    /// What came of a run.
    pub fn of(outcome: &Result<Summary, Fault>) -> Self {
        match outcome {
            Ok(summary) => Self::Run(Box::new(summary.clone())),
            Err(fault) => Self::Fault(fault.to_string()),
        }
    }

    /// Messages lost unread by then, per topic; `None` while more may be.
    pub(super) fn losses(&self, observer: &Observer) -> Option<Vec<u64>> {
        if matches!(self, Self::Off) {
            return None;
        }
        let topics = observer.read_counters().topics;
        Some(topics.iter().map(TopicView::dropped).collect())
    }

    /// What came of it, for the file.
    pub(super) fn mark(&self) -> RunStatus {
        match self {
            Self::Run(summary) => RunStatus::Ended(summary.end()),
            Self::Fault(fault) => RunStatus::Failed {
                fault: fault.clone(),
            },
            Self::Off => RunStatus::WentOn,
        }
    }
}

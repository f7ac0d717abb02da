//! The input of a recorder: a run, and finally the reason to stop.

use std::sync::Arc;

use ratelab::{
    experiment::{Experiment, Summary, Taps},
    runtime::{Fault, Observer, Snapshot, telemetry::TopicView},
    system::System,
};

use super::{
    schema::{Origin, RunResult, RunStatus},
    viewer::Viewer,
};

/// A run, for a recorder.
#[derive(Clone)]
pub struct Source {
    /// The system.
    pub system: Arc<dyn System>,
    /// The origin of the run.
    pub origin: Origin,
    /// The graph before the run.
    pub start: Snapshot,
    /// Reads the graph.
    pub observer: Observer,
    /// Access to its taps.
    pub taps: Taps,
    /// The viewer that gets the recording as well, if there is one.
    pub viewer: Option<Viewer>,
}

impl Source {
    /// The source for an experiment that has not begun.
    pub fn of(experiment: &Experiment) -> Self {
        let (system, observer) = (experiment.system().clone(), experiment.observer());
        let config = experiment.config().clone();
        Self {
            origin: Origin::new(&*system, config, observer.topology()),
            start: observer.snapshot(),
            taps: experiment.taps(),
            observer,
            system,
            viewer: None,
        }
    }

    /// Whether the plant has a picture. Before the run this is tested with a state of
    /// zeros.
    pub(super) fn has_picture(&self) -> bool {
        let mut topics = self.taps.topics().iter();
        let state = topics.find(|topic| Some(topic.name()) == self.system.state());
        let zeros = state.map(|state| vec![0.0; state.fields().len()]);
        zeros.is_some_and(|zeros| self.system.picture(&zeros).is_some())
    }
}

/// The reason for the end of a recording.
pub enum StopReason {
    /// The run ended.
    Run(Box<Summary>),
    /// A node failed.
    Fault(String),
    /// The recording was switched off; the run goes on.
    Off,
}

impl StopReason {
    /// The end of a run.
    pub fn of(outcome: &Result<Summary, Fault>) -> Self {
        match outcome {
            Ok(summary) => Self::Run(Box::new(summary.clone())),
            Err(fault) => Self::Fault(fault.to_string()),
        }
    }

    /// Messages lost unread so far, per topic; `None` if the run goes on.
    pub(super) fn losses(&self, observer: &Observer) -> Option<Vec<u64>> {
        if matches!(self, Self::Off) {
            return None;
        }
        let topics = observer.read_counters().topics;
        Some(topics.iter().map(TopicView::dropped).collect())
    }

    /// The status of a run of `system`, for the file.
    pub(super) fn status(&self, system: &dyn System) -> RunStatus {
        match self {
            Self::Run(summary) => RunStatus::Ended(RunResult::new(system, summary)),
            Self::Fault(fault) => RunStatus::Failed {
                fault: fault.clone(),
            },
            Self::Off => RunStatus::WentOn,
        }
    }
}

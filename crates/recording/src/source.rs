//! The input of a recorder: a run, and finally the reason to stop.

use std::sync::Arc;

use ratelab::Fault;
use ratelab_account::{Observer, RowTap, Snapshot, Tap, TickRecord, TopicAccount};
use ratelab_study::{
    experiment::{Experiment, Summary, Taps},
    system::System,
};

use super::{
    schema::{Origin, RunResult, RunStatus},
    viewer::Viewer,
};

/// A run whose messages and ticks can be copied: one of this process, or one that is
/// received from others.
pub trait Tapped: Send + Sync {
    /// Names of the numbers in a message of the topic called `topic`; `None` if it is not
    /// recorded.
    fn fields(&self, topic: &str) -> Option<&'static [&'static str]>;

    /// Its messages from now on, in a queue of `capacity`; `None` if it is not recorded.
    fn rows(&self, topic: &str, capacity: usize) -> Option<RowTap>;

    /// All ticks from now on, with one queue of `capacity` ticks per node.
    fn ticks(&self, capacity: usize) -> Vec<Tap<TickRecord>>;
}

impl Tapped for Taps {
    fn fields(&self, topic: &str) -> Option<&'static [&'static str]> {
        let mut topics = self.topics().iter();
        topics
            .find(|known| known.name() == topic)
            .map(|known| known.fields())
    }

    fn rows(&self, topic: &str, capacity: usize) -> Option<RowTap> {
        self.rows(topic, capacity)
    }

    fn ticks(&self, capacity: usize) -> Vec<Tap<TickRecord>> {
        self.ticks(capacity)
    }
}

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
    /// Its messages and ticks.
    pub taps: Arc<dyn Tapped>,
    /// The viewer that gets the recording as well, if there is one.
    pub viewer: Option<Viewer>,
    /// Prints a notice about the run while it is recorded, where nothing else shows it.
    pub notice: fn(&str),
}

impl Source {
    /// The source for an experiment that has not begun.
    pub fn of(experiment: &Experiment) -> Self {
        let (system, observer) = (experiment.system().clone(), experiment.observer());
        let config = experiment.config().clone();
        Self {
            origin: Origin::new(&*system, config, observer.topology()),
            start: observer.snapshot(),
            taps: Arc::new(experiment.taps()),
            observer,
            system,
            viewer: None,
            notice: |_| {},
        }
    }

    /// Whether the plant has a picture. Before the run this is tested with a state of
    /// zeros.
    pub(super) fn has_picture(&self) -> bool {
        let fields = self
            .system
            .state()
            .and_then(|state| self.taps.fields(state));
        let zeros = fields.map(|fields| vec![0.0; fields.len()]);
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
        let topics = observer.snapshot().topics;
        Some(topics.iter().map(TopicAccount::dropped).collect())
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

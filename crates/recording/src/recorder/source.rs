//! The input of a recorder: a run, and finally the reason to stop.

use std::sync::Arc;

use ratelab::{Fault, Topology};
use ratelab_experiment::{Experiment, Summary, Taps};
use ratelab_metrics::{Observer, Rows, RunRow, Snapshot, Tap, TopicAccount};
use ratelab_re_execution::RunLog;
use ratelab_system::System;

use crate::run::{Origin, Recording, RecordingEnd, RunResult, RunRows, RunStatus, ThreadLog};

/// A run whose messages and ticks can be copied: one of this process, or one that is
/// received from others.
pub trait Tapped: Send + Sync {
    /// Returns the names of the numbers in a message of the topic called `topic`; `None` if it is not
    /// recorded.
    fn fields(&self, topic: &str) -> Option<&[String]>;

    /// Returns all messages of recorded topics and all ticks from now on, in a queue of `capacity`.
    fn all(&self, capacity: usize) -> Tap<RunRow>;

    /// Room for the rows of a graph with this `topology`, each message with as many numbers as
    /// its topic has names for.
    fn empty_rows(&self, topology: &Topology) -> RunRows {
        let topics = topology.topics.iter();
        let widths = topics.map(|topic| self.fields(&topic.name).unwrap_or_default().len());
        RunRows {
            topics: widths.map(Rows::new).collect(),
            ..RunRows::empty(topology)
        }
    }
}

impl Tapped for Taps {
    fn fields(&self, topic: &str) -> Option<&[String]> {
        self.topics()
            .iter()
            .find(|known| known.name() == topic)
            .map(|known| known.fields())
    }

    fn all(&self, capacity: usize) -> Tap<RunRow> {
        self.all(capacity)
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
    /// Prints a notice about the run while it is recorded, where nothing else shows it.
    pub notice: fn(&str),
}

impl Source {
    /// Creates the source for an experiment that has not begun.
    pub fn for_experiment(experiment: &Experiment) -> Self {
        let (system, observer) = (experiment.system().clone(), experiment.observer());
        let config = experiment.config().clone();
        Self {
            origin: Origin::new(&*system, config, observer.topology()),
            start: observer.snapshot(),
            taps: Arc::new(experiment.taps()),
            observer,
            system,
            notice: |_| {},
        }
    }

    /// Returns the run so far as a recording without messages and ticks: enough to execute it
    /// again. `end` is how it ended, if it did.
    pub fn so_far(&self, end: &StopReason) -> Recording {
        // The events after the log, which mentions some.
        let log = RunLog::attach(&self.observer).log();
        let outcome = end.end(&*self.system, &self.observer);
        let events = self.observer.events(0);
        let threads = (!log.is_empty()).then(|| ThreadLog {
            log,
            events: events.clone(),
            damage: None,
        });
        Recording {
            events,
            threads,
            until: outcome.at,
            outcome: Some(outcome),
            ..Recording::empty(self.origin.clone())
        }
    }

    /// Returns whether the plant has a picture. Before the run this is tested with a state of
    /// zeros.
    pub(crate) fn has_picture(&self) -> bool {
        let fields = self
            .system
            .state()
            .and_then(|state| self.taps.fields(state));
        let zeros = fields.map(|fields| vec![0.0; fields.len()]);
        zeros.is_some_and(|zeros| self.system.robot().picture(&zeros).is_some())
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
    /// Creates the reason of the end from the outcome of a run.
    pub fn from_outcome(outcome: &Result<Summary, Fault>) -> Self {
        match outcome {
            Ok(summary) => Self::Run(Box::new(summary.clone())),
            Err(fault) => Self::Fault(fault.to_string()),
        }
    }

    /// Returns the end of a run of `system` for this reason, without what is in the file.
    pub(crate) fn end(&self, system: &dyn System, observer: &Observer) -> RecordingEnd {
        let topics = observer.snapshot().topics;
        let ended = !matches!(self, Self::Off);
        let in_all =
            |count: fn(&TopicAccount) -> u64| ended.then(|| topics.iter().map(count).collect());
        RecordingEnd {
            at: observer.now(),
            clock: observer.status().clock,
            end: match self {
                Self::Run(summary) => RunStatus::Ended(RunResult::new(system, summary)),
                Self::Fault(fault) => RunStatus::Failed {
                    fault: fault.clone(),
                },
                Self::Off => RunStatus::WentOn,
            },
            messages: Vec::new(),
            ticks: Vec::new(),
            lost: 0,
            dropped: in_all(TopicAccount::dropped),
            unmatched: in_all(TopicAccount::unmatched),
            threads: None,
            digest: None,
        }
    }
}

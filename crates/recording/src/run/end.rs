//! The end of a recording: how the run ended, and how much of it is recorded.

use std::{collections::BTreeMap, time::Duration};

use ratelab::{ClockKind, Time};
use ratelab_experiment::Summary;
use ratelab_system::{System, Verdict, VerdictKind};
use serde::{Deserialize, Serialize};

/// The end of a recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordingEnd {
    /// Run time of the end.
    pub at: Time,
    /// The clock at the end.
    pub clock: ClockKind,
    /// The end of the run.
    pub end: RunStatus,
    /// Messages in the file, per topic of the graph.
    pub messages: Vec<u64>,
    /// Ticks in the file, per node of the graph.
    pub ticks: Vec<u64>,
    /// Number of messages and ticks lost because the recorder was too slow.
    pub lost: u64,
    /// Messages lost unread at the end of the run, per topic of the graph: a queue
    /// made shallower may lose some after the last message. Unknown for a run that went
    /// on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dropped: Option<Vec<u64>>,
    /// Messages that matches took and used in no set, per topic of the graph, at the end of the run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unmatched: Option<Vec<u64>>,
    /// Digest of the log of the threads; `None` if the run was never under the real clock.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub threads: Option<u64>,
    /// Digest of all else that readers read of the file; `None` in files of early versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub digest: Option<u64>,
}

impl RecordingEnd {
    /// Returns the result of the run, if it ended with one.
    pub fn result(&self) -> Option<&RunResult> {
        match &self.end {
            RunStatus::Ended(result) => Some(result),
            RunStatus::Failed { .. } | RunStatus::WentOn => None,
        }
    }
}

/// The end of a recorded run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum RunStatus {
    /// It ended, with a result.
    Ended(RunResult),
    /// A node failed.
    Failed {
        /// The error.
        fault: String,
    },
    /// It went on after the end of the recording.
    WentOn,
}

/// The result of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunResult {
    /// The verdict.
    pub verdict: VerdictRecord,
    /// Steps of the plant.
    pub steps: u64,
    /// Run time.
    pub sim_time: Time,
    /// Wall time of the run.
    pub wall_time: Duration,
    /// Figures of the last state by their names; `None` for values that are not finite.
    /// See [`Judge::finals`](ratelab_system::Judge::finals).
    pub finals: BTreeMap<String, Option<f64>>,
}

/// A verdict by its name in the system.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VerdictRecord {
    /// [`VerdictKind::name`].
    pub name: String,
    /// Run time.
    pub at: Time,
}

impl RunResult {
    /// Creates the result of a run of `system` with this `summary`.
    pub fn new(system: &dyn System, summary: &Summary) -> Self {
        let finals = system
            .judge()
            .finals(&summary.state)
            .into_iter()
            .map(|figure| {
                let finite = Some(figure.value).filter(|value| value.is_finite());
                (figure.name.into_owned(), finite)
            });
        Self {
            verdict: VerdictRecord {
                name: summary.verdict.name().to_owned(),
                at: summary.verdict.at,
            },
            steps: summary.steps,
            sim_time: summary.sim_time,
            wall_time: summary.wall_time,
            finals: finals.collect(),
        }
    }
}

impl VerdictRecord {
    /// Returns the verdict of a run of `system`; without a text if the system has none of this
    /// name.
    pub fn verdict(&self, system: &dyn System) -> Verdict {
        /// A verdict of another system.
        const OTHER: VerdictKind = VerdictKind::held("other", "ended at {at}");
        let mut kinds = system.verdicts().into_iter();
        let kind = kinds.find(|kind| kind.name == self.name);
        Verdict::new(kind.unwrap_or(OTHER), self.at)
    }
}

//! The beginning of a recording, which names the run and its software, and its end.

use std::{collections::BTreeMap, fmt, time::Duration};

use ratelab::{ClockKind, Digest, Draw, Knob, Time, Topology, millis};
use ratelab_experiment::{Config, Summary};
use ratelab_system::{PlantRecord, System, Verdict, VerdictKind};
use serde::{Deserialize, Serialize};

/// Version of what a recording holds. A reader refuses a later one.
pub const FORMAT: u32 = 3;

/// The run and its software: enough to repeat it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Origin {
    /// Version of what it holds: a reader refuses a later one.
    pub format: u32,
    /// Version of ratelab.
    pub ratelab: String,
    /// The engine of the plant, with its version; see
    /// [`RobotInfo::engine`](ratelab_system::RobotInfo::engine).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub engine: Option<String>,
    /// Processor and operating system, such as `x86_64-linux`: the last bit of
    /// mathematical functions may differ between platforms.
    pub platform: String,
    /// Name of the system.
    pub system: String,
    /// The text of its graph file, if any; see [`About`](ratelab_system::About).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub graph_file: Option<String>,
    /// The robot in the middle of that graph, if it moves by itself; see
    /// [`About::plant`](ratelab_system::About::plant).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plant: Option<PlantRecord>,
    /// The configuration at the start.
    pub config: Config,
    /// The durations in files that its configuration draws from, by their digests (ns).
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub durations: RecordedDurations,
    /// The graph at the start.
    #[serde(rename = "shape")]
    pub topology: Topology,
    /// Whether the end has a digest of the content: not in files of early versions.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub digest: bool,
    /// The processes that were recorded, of a run in several; empty for a run in one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub processes: Vec<ProcessRecord>,
}

/// A process of a run in several.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ProcessRecord {
    /// Name of its machine.
    pub host: String,
    /// Its number there.
    pub pid: u32,
    /// The nodes that run in it.
    pub nodes: Vec<String>,
    /// The greatest error of its times (ns) when the recording began: zero for the machine
    /// whose run time it is; `None` if it was unknown.
    pub error_ns: Option<u64>,
}

impl fmt::Display for ProcessRecord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let nodes = self.nodes.join(" and ");
        write!(f, "{nodes} in process {} on {}", self.pid, self.host)?;
        match self.error_ns {
            Some(0) => Ok(()),
            Some(error) => write!(f, ", times ±{} ms", millis::text(error as f64 / 1e6)),
            None => write!(f, ", times ?"),
        }
    }
}

impl Origin {
    /// Creates the origin of a run of `system` by this program.
    pub fn new(system: &dyn System, config: Config, topology: Topology) -> Self {
        let (engine, about) = (system.robot().engine(), system.about());
        let timed = config.knobs.iter().map(|timed| &timed.knob);
        let knobs = config.setup.iter().chain(timed);
        Self {
            format: FORMAT,
            ratelab: env!("CARGO_PKG_VERSION").to_owned(),
            engine: engine.map(|(name, version)| format!("{name} {version}")),
            platform: platform(),
            system: system.name().to_owned(),
            graph_file: about.graph_file.map(str::to_owned),
            plant: about.plant.cloned(),
            durations: drawn_from(knobs),
            config,
            topology,
            digest: true,
            processes: Vec::new(),
        }
    }

    /// Returns the software of the recording, with versions.
    pub fn made_by(&self) -> String {
        let ratelab = format!("ratelab {}", self.ratelab);
        let parts = [Some(&ratelab), self.engine.as_ref(), Some(&self.platform)];
        let parts: Vec<&str> = parts.into_iter().flatten().map(String::as_str).collect();
        parts.join(", ")
    }
}

/// Processor and operating system of this computer.
fn platform() -> String {
    use std::env::consts::{ARCH, OS};
    format!("{ARCH}-{OS}")
}

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
        let kind = system
            .verdicts()
            .into_iter()
            .find(|kind| kind.name == self.name);
        Verdict::new(kind.unwrap_or(OTHER), self.at)
    }
}

/// The durations of files, by their digests (ns).
pub type RecordedDurations = BTreeMap<Digest, Vec<u64>>;

/// Returns the durations in files that the knobs of a run draw from.
pub fn drawn_from<'k>(knobs: impl Iterator<Item = &'k Knob>) -> RecordedDurations {
    let measured = knobs.filter_map(|knob| match knob.draw()? {
        Draw::Measured(measured) if !measured.is_recorded() => Some(measured),
        _ => None,
    });
    let durations = measured.filter_map(|measured| {
        let nanos = measured.durations()?.iter();
        let nanos = nanos.map(|duration| duration.as_nanos() as u64);
        Some((measured.digest()?, nanos.collect()))
    });
    durations.collect()
}

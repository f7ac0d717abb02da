//! Names in a recording, and its description of itself.

use std::{collections::BTreeMap, time::Duration};

use ratelab::{
    experiment::{Config, Summary},
    runtime::{ClockKind, Speed, Time, TimedKnob, telemetry::Topology},
    system::{Setup, System, Verdict, VerdictKind, WorldKind},
};
use rerun::{EntityPath, EntityPathPart};
use serde::{Deserialize, Serialize};

/// Version of what is laid down here. A reader refuses a later one.
pub const FORMAT: u32 = 2;

/// Name by which the viewer groups recordings.
pub const APPLICATION: &str = "ratelab";

/// The same for the curves of sweeps: the viewer keeps a layout for each name.
pub const SWEEP_APPLICATION: &str = "ratelab-sweep";

/// Property with the [`Origin`].
pub const ORIGIN: &str = "origin";

/// Entity of what happened to the run: text for people, [`JSON`] for readers.
pub const EVENTS: &str = "/events";

/// Entity of the last thing written, a [`RecordingEnd`]. A file without it was torn.
pub const END: &str = "/end";

/// Entity of marks up to which everything is in the file.
pub const CHECKPOINT: &str = "/checkpoint";

/// Component of a checkpoint: run time (ns).
pub const UNTIL: &str = "until_ns";

/// Component with a value as JSON.
pub const JSON: &str = "json";

/// Components of a message, beside its numbers.
pub mod message {
    /// Position in the topic's history.
    pub const SEQ: &str = "seq";
    /// Run time of the sensing it was derived from (ns).
    pub const ORIGIN: &str = "origin_ns";
    /// Its stamp (ns), where that is not the run time of its publication.
    pub const STAMP: &str = "stamp_ns";
    /// Run time of its delivery (ns), where that is not that of its publication;
    /// [`LOST`] if there is none.
    pub const ARRIVES: &str = "arrives_ns";
    /// The delivery of a lost message.
    pub const LOST: u64 = u64::MAX;
    /// Messages of the topic lost unread so far.
    pub const DROPPED: &str = "dropped";
}

/// Components of a tick.
pub mod tick {
    /// Number of the tick.
    pub const NUMBER: &str = "tick";
    /// How long it took (ns).
    pub const TOOK: &str = "took_ns";
    /// Periods skipped so far.
    pub const OVERRUNS: &str = "overruns";
    /// Run time at which it acted on the world, where it did (ns).
    pub const PUSHED: &str = "pushed_ns";
    /// Run time of the sensing behind that (ns).
    pub const SENSED: &str = "sensed_ns";
}

/// The entity with these parts of a path, whatever characters are in them.
pub fn path(parts: &[&str]) -> EntityPath {
    EntityPath::new(
        parts
            .iter()
            .map(|part| EntityPathPart::new(*part))
            .collect(),
    )
}

/// Entity of the messages of a topic.
pub fn topic_entity(name: &str) -> EntityPath {
    let parts = name.split('/').filter(|part| !part.is_empty());
    path(&std::iter::once("topics").chain(parts).collect::<Vec<_>>())
}

/// Parent of the entities of all nodes.
pub const NODES: &str = "nodes";

/// Entity of the ticks of a node. How late they began is there as a series (µs),
/// not a number where the clock is never late.
pub fn node_entity(name: &str) -> EntityPath {
    path(&[NODES, name])
}

/// The run and its software: enough to run it again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Origin {
    /// [`FORMAT`] of the file.
    pub format: u32,
    /// Version of ratelab.
    pub ratelab: String,
    /// The engine of the plant, with its version; see [`System::engine`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub engine: Option<String>,
    /// Processor and operating system, such as `x86_64-linux`: mathematical
    /// functions may differ in their last bit between them.
    pub platform: String,
    /// Name of the system.
    pub system: String,
    /// The configuration at the start.
    #[serde(with = "ConfigRecord")]
    pub config: Config,
    /// The graph when it was started.
    #[serde(rename = "shape")]
    pub topology: Topology,
}

/// A [`Config`] as it stands in a file: these names stay, whatever becomes of
/// those in the code. A knob stands as it does in the event log.
#[derive(Serialize, Deserialize)]
#[serde(remote = "Config")]
struct ConfigRecord {
    seed: u64,
    clock: ClockKind,
    speed: Speed,
    end: Time,
    setup: Setup,
    #[serde(default, skip_serializing_if = "WorldKind::is_course")]
    world: WorldKind,
    knobs: Vec<TimedKnob>,
}

impl Origin {
    /// Of a run of `system` that this program makes.
    pub fn new(system: &dyn System, config: Config, topology: Topology) -> Self {
        Self {
            format: FORMAT,
            ratelab: env!("CARGO_PKG_VERSION").to_owned(),
            engine: system.engine(),
            platform: platform(),
            system: system.name().to_owned(),
            config,
            topology,
        }
    }

    /// By what the recording was made, with versions.
    pub fn made_by(&self) -> String {
        let ratelab = format!("ratelab {}", self.ratelab);
        let parts = [Some(&ratelab), self.engine.as_ref(), Some(&self.platform)];
        let parts: Vec<&str> = parts.into_iter().flatten().map(String::as_str).collect();
        parts.join(", ")
    }
}

/// Processor and operating system of this program.
fn platform() -> String {
    use std::env::consts::{ARCH, OS};
    format!("{ARCH}-{OS}")
}

/// How a recording ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordingEnd {
    /// Run time then.
    pub at: Time,
    /// The clock then.
    pub clock: ClockKind,
    /// The end of the run.
    pub end: RunStatus,
    /// Messages in the file, per topic of the [`Topology`].
    pub messages: Vec<u64>,
    /// Ticks in the file, per node of the [`Topology`].
    pub ticks: Vec<u64>,
    /// Messages and ticks that came faster than they could be recorded.
    pub lost: u64,
    /// Messages lost unread when the run ended, per topic of the [`Topology`]: a queue
    /// made shallower loses some after the last message. Not known of a run that
    /// went on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dropped: Option<Vec<u64>>,
}

/// The end of a run that was recorded.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum RunStatus {
    /// It ended.
    Ended(RunResult),
    /// A node failed.
    Failed {
        /// The error.
        fault: String,
    },
    /// It went on, only its recording ended.
    WentOn,
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunResult {
    /// The verdict.
    pub verdict: VerdictRecord,
    /// Steps of the plant.
    pub steps: u64,
    /// Run time.
    pub sim_time: Time,
    /// Wall time that it took.
    pub wall_time: Duration,
    /// Figures of the last state by their names; none that is not finite. See
    /// [`System::finals`].
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
    /// That of a run of `system` with this `summary`.
    pub fn new(system: &dyn System, summary: &Summary) -> Self {
        let finals = system.finals(&summary.state).into_iter();
        let finals = finals.map(|figure| {
            let finite = Some(figure.value).filter(|value| value.is_finite());
            (figure.name.to_owned(), finite)
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
    /// The verdict of a run of `system`; one without a text if it has none of this
    /// name.
    pub fn verdict(&self, system: &dyn System) -> Verdict {
        /// A verdict of another system.
        const OTHER: VerdictKind = VerdictKind {
            name: "other",
            lost: false,
            text: "ended at {at}",
        };
        let mut kinds = system.verdicts().iter();
        let kind = kinds.find(|kind| kind.name == self.name);
        Verdict::new(kind.map_or(&OTHER, |kind| kind), self.at)
    }
}

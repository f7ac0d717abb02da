//! Names in a recording, and what it says of itself.

use ratelab::{
    cartpole::mujoco_version,
    experiment::{Config, RunEnd},
    runtime::{ClockKind, Time, telemetry::Topology},
};
use serde::{Deserialize, Serialize};

/// Version of what is laid down here. A reader refuses a later one.
pub const FORMAT: u32 = 1;

/// Name by which the viewer groups recordings.
pub const APPLICATION: &str = "ratelab";

/// The same for the curves of sweeps: the viewer keeps a layout for each name.
pub const SWEEP_APPLICATION: &str = "ratelab-sweep";

/// Property that says what was run, to be read by [`Origin`].
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
}

/// Entity of the messages of a topic.
pub fn topic_entity(name: &str) -> String {
    format!("/topics/{}", name.trim_start_matches('/'))
}

/// Parent of the entities of all nodes.
pub const NODES: &str = "/nodes";

/// Entity of the ticks of a node. How late they began is there as a series (µs),
/// not a number where the clock is never late.
pub fn node_entity(name: &str) -> String {
    format!("{NODES}/{name}")
}

/// What was run, and by what: enough to run it again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Origin {
    /// [`FORMAT`] of the file.
    pub format: u32,
    /// Version of ratelab.
    pub ratelab: String,
    /// Version of MuJoCo.
    pub mujoco: String,
    /// Processor and system, such as `x86_64-linux`: mathematical functions may
    /// differ in their last bit between them.
    pub platform: String,
    /// What the run was started with.
    pub config: Config,
    /// The graph when it was started.
    #[serde(rename = "shape")]
    pub topology: Topology,
}

impl Origin {
    /// Of a run that this program makes.
    pub fn new(config: Config, topology: Topology) -> Self {
        Self {
            format: FORMAT,
            ratelab: env!("CARGO_PKG_VERSION").to_owned(),
            mujoco: mujoco_version().to_owned(),
            platform: platform(),
            config,
            topology,
        }
    }
}

/// Processor and system of this program.
pub fn platform() -> String {
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
    /// What became of the run.
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

/// What became of a run that was recorded.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum RunStatus {
    /// It ended.
    Ended(RunEnd),
    /// A node failed.
    Failed {
        /// What was said of it.
        fault: String,
    },
    /// It went on, only its recording ended.
    WentOn,
}

//! The beginning of a recording: which run it is, and of which software.

use std::fmt;

use ratelab::{Topology, millis};
use ratelab_experiment::Config;
use ratelab_system::{PlantRecord, System};
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
    /// The engine of the plant, with its version; see [`RobotInfo::engine`](ratelab_system::RobotInfo::engine).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub engine: Option<String>,
    /// Processor and operating system, such as `x86_64-linux`: the last bit of
    /// mathematical functions may differ between platforms.
    pub platform: String,
    /// Name of the system.
    pub system: String,
    /// The text of its graph file, if any; see [`About`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub graph_file: Option<String>,
    /// The robot in the middle of that graph, if it moves by itself; see
    /// [`About::plant`](ratelab_system::About::plant).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plant: Option<PlantRecord>,
    /// The configuration at the start.
    pub config: Config,
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
        Self {
            format: FORMAT,
            ratelab: env!("CARGO_PKG_VERSION").to_owned(),
            engine: engine.map(|(name, version)| format!("{name} {version}")),
            platform: platform(),
            system: system.name().to_owned(),
            graph_file: about.graph_file.map(str::to_owned),
            plant: about.plant.cloned(),
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

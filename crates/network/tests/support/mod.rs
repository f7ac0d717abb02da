//! Shared helpers for tests of runs in several processes.

#![allow(dead_code)] // Each test uses its own part.

mod address;

use std::{
    fs,
    path::{Path, PathBuf},
    sync::Arc,
    thread,
};

pub use address::address;
use ratelab::Time;
use ratelab_experiment::{Config, Experiment};
use ratelab_network::{Bridge, SessionEnd, Settings};
use ratelab_system::{System, graph_file::GraphFile};
use zenoh::Wait;

/// The configurations of the manual.
pub const MANUAL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/network");

/// The graph of a file with this `text`.
pub fn graph(text: &str) -> Arc<dyn System> {
    let graph = GraphFile::parse(text).and_then(|graph| graph.system(&[]));
    Arc::new(graph.expect("a graph"))
}

/// The settings of the end that listens, with the zenoh configuration `file`.
pub fn listen(address: &str, file: Option<&Path>) -> Settings {
    settings(SessionEnd::Listen(vec![address.to_owned()]), file)
}

/// The settings of an end that connects.
pub fn connect(address: &str, file: Option<&Path>) -> Settings {
    settings(SessionEnd::Connect(vec![address.to_owned()]), file)
}

fn settings(end: SessionEnd, file: Option<&Path>) -> Settings {
    Settings {
        file: file.map(Path::to_owned),
        ..Settings::new(end, |_| ())
    }
}

/// The configuration `name` of the manual with `names` replaced by paths in `folder`, without the
/// lines that begin with one of `left_out`.
pub fn of_manual(folder: &Path, name: &str, names: &[&str], left_out: &[&str]) -> PathBuf {
    let text = fs::read_to_string(Path::new(MANUAL).join(name)).expect("in the manual");
    let is_left_out = |line: &&str| left_out.iter().any(|begin| line.trim().starts_with(begin));
    let lines = text.lines().filter(|line| !is_left_out(line));
    let text = lines.collect::<Vec<_>>().join("\n");
    let text = names.iter().fold(text, |text, file| {
        text.replace(file, &folder.join(file).display().to_string())
    });
    let path = folder.join(format!("{}-{name}", left_out.len()));
    fs::write(&path, text).expect("written");
    path
}

/// Whether an end with these settings connects within a moment.
pub fn connects(settings: &Settings) -> bool {
    let mut connection = settings.config().expect("settings");
    let once = connection.insert_json5("connect/timeout_ms", "500");
    once.expect("a setting of zenoh");
    zenoh::open(connection).wait().is_ok()
}

/// Waits until `reached`; the run of a test ends if it never is.
pub fn until(mut reached: impl FnMut() -> bool) {
    while !reached() {
        thread::yield_now();
    }
}

/// Waits until both know each other: before, nothing could arrive.
pub fn until_met(one: &Bridge, other: &Bridge) {
    until(|| !one.others().is_empty() && !other.others().is_empty());
}

/// The part of a run of two seconds that has these `nodes`; with `ros` also in that domain.
pub fn part(
    system: Arc<dyn System>,
    nodes: &[&str],
    settings: &Settings,
    ros: Option<u32>,
) -> (Experiment, Bridge) {
    part_for(2.0, system, nodes, settings, ros)
}

/// The part of a run of so many `seconds`.
pub fn part_for(
    seconds: f64,
    system: Arc<dyn System>,
    nodes: &[&str],
    settings: &Settings,
    ros: Option<u32>,
) -> (Experiment, Bridge) {
    let here: Vec<String> = nodes.iter().map(|&node| node.to_owned()).collect();
    let config = Config {
        end: Time::from_secs_f64(seconds).expect("seconds"),
        ..Config::default()
    };
    let part = Experiment::part(system, &config, &here).expect("a part");
    let bridge = Bridge::start(settings, &part, &here, ros).expect("connected");
    (part, bridge)
}

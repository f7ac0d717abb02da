//! The names in a recording, and the digest of all that readers read of it.

use ratelab::Topology;
use rerun::{EntityPath, EntityPathPart};
use xxhash_rust::xxh3::Xxh3;

use crate::run::{RecordRow, RecordingEnd};

/// Name by which the viewer groups recordings.
pub const APPLICATION: &str = "ratelab";

/// Name for the curves of sweeps: the viewer stores one layout per name.
pub const SWEEP_APPLICATION: &str = "ratelab-sweep";

/// Property with the [`Origin`](crate::Origin).
pub const ORIGIN: &str = "origin";

/// Entity of the events of the run: text for people, [`JSON`] for readers.
pub const EVENTS: &str = "/events";

/// Entity of the last item written, a [`RecordingEnd`]. A file without it was cut off.
pub const END: &str = "/end";

/// Entity of marks up to which the file is complete.
pub const CHECKPOINT: &str = "/checkpoint";

/// Entity of the log of the threads of the real clock.
pub const THREADS: &str = "/threads";

/// Component of a checkpoint: run time (ns).
pub const UNTIL: &str = "until_ns";

/// Component with a value as JSON.
pub const JSON: &str = "json";

/// Returns the entity with these parts of a path, with any characters.
pub fn path(parts: &[&str]) -> EntityPath {
    EntityPath::new(
        parts
            .iter()
            .map(|part| EntityPathPart::new(*part))
            .collect(),
    )
}

/// Returns the entity of the messages of a topic.
pub fn topic_entity(name: &str) -> EntityPath {
    let parts = name.split('/').filter(|part| !part.is_empty());
    path(&std::iter::once("topics").chain(parts).collect::<Vec<_>>())
}

/// Parent of the entities of all nodes.
pub const NODES: &str = "nodes";

/// Returns the entity of the ticks of a node. Their lateness is a series there (µs), NaN under a
/// clock without lateness.
pub fn node_entity(name: &str) -> EntityPath {
    path(&[NODES, name])
}

/// The digest of a recording so far, for its writer and its reader.
#[derive(Default)]
pub struct ContentDigest {
    origin: Xxh3,
    /// Of each topic.
    pub topics: Vec<RowDigest>,
    /// Of each node.
    pub nodes: Vec<RowDigest>,
    events: Xxh3,
}

/// The digest of the messages of a topic, or of the ticks of a node.
#[derive(Clone, Default)]
pub struct RowDigest {
    hash: Xxh3,
    /// Number of rows.
    pub rows: u64,
}

impl RowDigest {
    /// Adds a row with its payload.
    pub fn add<R: RecordRow>(&mut self, row: &R, payload: &[f64]) {
        self.rows += 1;
        let mut add = |word: u64| self.hash.update(&word.to_le_bytes());
        for (column, cell) in R::COLUMNS.iter().zip(row.cells()) {
            if !column.is_full() {
                add(cell.is_some().into());
            }
            add(cell.unwrap_or_default());
        }
        if R::LIST.is_some() {
            let list = row.list();
            add(list.len() as u64);
            list.into_iter().for_each(&mut add);
        }
        payload.iter().for_each(|value| add(value.to_bits()));
    }
}

impl ContentDigest {
    /// Begins with the description of the run, as JSON, and its graph.
    pub fn new(origin: &str, topology: &Topology) -> Self {
        let mut digest = Self {
            topics: vec![RowDigest::default(); topology.topics.len()],
            nodes: vec![RowDigest::default(); topology.nodes.len()],
            ..Self::default()
        };
        digest.origin.update(origin.as_bytes());
        digest
    }

    /// Adds an event, as JSON.
    pub fn add_event(&mut self, json: &str) {
        self.events.update(json.as_bytes());
        self.events.update(b"\n");
    }

    /// Returns the digest of a recording with this `end`.
    pub fn with_end(&self, end: &RecordingEnd) -> u64 {
        let end = RecordingEnd {
            digest: None,
            ..end.clone()
        };
        let series = self
            .topics
            .iter()
            .chain(&self.nodes)
            .map(|series| &series.hash);
        let parts = [&self.origin, &self.events].into_iter().chain(series);
        let mut whole = Xxh3::new();
        parts.for_each(|part| whole.update(&part.digest().to_le_bytes()));
        whole.update(serde_json::to_string(&end).unwrap_or_default().as_bytes());
        whole.digest()
    }
}

//! Names in a file of rerun's.

use rerun::{EntityPath, EntityPathPart};

/// Name by which the viewer groups recordings.
pub const APPLICATION: &str = "ratelab";

/// Name for the curves of sweeps: the viewer stores one layout per name.
pub const SWEEP_APPLICATION: &str = "ratelab-sweep";

/// Property with the [`Origin`](crate::Origin).
pub const ORIGIN: &str = "origin";

/// Entity of the events of the run: text for people, [`JSON`] for readers.
pub const EVENTS: &str = "/events";

/// Entity of the last item written, a [`RecordingEnd`](crate::RecordingEnd). A file without it was cut off.
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

//! What is told of a recording when it is complete.

use std::{path::PathBuf, sync::Arc};

/// A complete recording.
#[derive(Clone, Debug)]
pub struct FinishedRecording {
    /// The file.
    pub path: PathBuf,
    /// Its size in bytes.
    pub bytes: u64,
    /// Number of messages.
    pub messages: u64,
    /// Number of messages and ticks lost because the recorder was too slow.
    pub lost: u64,
    /// What threads outside of the graph wrote to, so that the run cannot come back.
    pub written_from_outside: Vec<Arc<str>>,
}

impl FinishedRecording {
    /// The reason why `verify` will refuse the recording, if there is one.
    pub fn defect(&self) -> Option<String> {
        let names = &self.written_from_outside;
        (!names.is_empty()).then(|| outside(&names.join(" and ")))
    }
}

/// The notice that a thread outside of the graph wrote to `name`.
pub fn outside(name: &str) -> String {
    format!(
        "a thread outside of the graph wrote to {name}: verify will refuse a recording of this run"
    )
}

//! A format of recordings, and what becomes of one.

use std::{
    io,
    path::{Path, PathBuf},
    sync::Arc,
};

use ratelab_metrics::{RunRow, Tap};
use thiserror::Error;

use super::source::{Source, StopReason};

/// A format of recordings.
pub trait RecordingFormat: Send + Sync {
    /// Returns the extension of its files, such as `rrd`.
    fn extension(&self) -> &'static str;

    /// Creates the file `path`, which must be new, on the thread of the caller.
    ///
    /// # Errors
    /// The system's error for the file.
    fn create(&self, path: &Path) -> io::Result<BeginRun>;
}

/// Writes the beginning of a run to a new file, on the thread of the recorder. The writer must not keep
/// [`Source::taps`]: that would keep other taps of the run open.
pub type BeginRun = Box<dyn FnOnce(Source) -> io::Result<Box<dyn RunWriter>> + Send>;

/// Writes a run to its file.
pub trait RunWriter {
    /// Takes the rows that are in `tap`, a few times a second. Returns whether there were so
    /// many that it should be called again at once.
    ///
    /// # Errors
    /// An error ends the recording.
    fn look(&mut self, tap: &Tap<RunRow>) -> io::Result<bool>;

    /// Writes the remaining rows and the end. Until `tap` is dropped the run may wait for it.
    ///
    /// # Errors
    /// The first error of the file.
    fn complete(
        self: Box<Self>,
        tap: Tap<RunRow>,
        reason: &StopReason,
    ) -> io::Result<FinishedRecording>;
}

/// A recording that did not begin, or ended early.
#[derive(Debug, Error)]
#[error("the recording {} ended early: {why}", path.display())]
pub struct RecordError {
    /// The file; what is written of it is intact up to its last second.
    pub path: PathBuf,
    /// The error of the operating system.
    pub why: io::Error,
}

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
    /// Whether something only for viewing was left out because the end was overdue.
    pub hurried: bool,
}

impl FinishedRecording {
    /// Returns why `verify` will refuse the recording, if it will.
    pub fn defect(&self) -> Option<String> {
        let names = &self.written_from_outside;
        (!names.is_empty()).then(|| outside(&names.join(" and ")))
    }
}

/// Returns the notice that a thread outside of the graph wrote to `name`.
pub fn outside(name: &str) -> String {
    format!(
        "a thread outside of the graph wrote to {name}: verify will refuse a recording of this run"
    )
}

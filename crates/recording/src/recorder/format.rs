//! The format of recordings, and their files.

use std::{
    io,
    path::{Path, PathBuf},
    sync::Arc,
};

use ratelab_metrics::{RunRow, Tap};
use thiserror::Error;

use super::source::{Source, StopReason};
use crate::run::Origin;

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

/// Default folder of recordings.
const FOLDER: &str = "recordings";

/// The destination of recordings: a file name, a folder, or the folder `recordings`.
/// Existing files are never written to.
#[derive(Clone)]
pub struct Destination {
    named: Option<PathBuf>,
    /// Whether the name has been used.
    used: bool,
    format: Arc<dyn RecordingFormat>,
}

impl Destination {
    /// Creates a destination of files of this `format` at `place`, a new file or an existing
    /// folder; by default in `recordings`.
    pub fn new(place: Option<PathBuf>, format: impl RecordingFormat + 'static) -> Self {
        Self {
            named: place,
            used: false,
            format: Arc::new(format),
        }
    }

    /// Creates the file for a recording of the run of `origin`. A default name, or one already
    /// used by this destination, gets a number until it is free.
    ///
    /// # Errors
    /// The system's error for the file.
    pub fn create(&mut self, origin: &Origin) -> Result<(PathBuf, BeginRun), RecordError> {
        let (first, chosen) = self.first(origin);
        let mut number = 1;
        loop {
            let path = numbered(&first, number);
            match self.format.create(&path) {
                Ok(begin) => return Ok((path, begin)),
                // Another program may have created it first.
                Err(error) if !chosen && path.is_file() && is_taken(&error) => number += 1,
                Err(why) => return Err(RecordError { path, why }),
            }
        }
    }

    /// Returns the first name to try, and whether the user chose it, so that it must not be
    /// changed.
    fn first(&mut self, origin: &Origin) -> (PathBuf, bool) {
        match &self.named {
            Some(folder) if folder.is_dir() => (folder.join(self.name(origin)), false),
            Some(file) => (file.clone(), !std::mem::replace(&mut self.used, true)),
            None => (Path::new(FOLDER).join(self.name(origin)), false),
        }
    }

    /// Returns a name from the start time and the run, such as
    /// `2026-03-14T15-09-26_cart-pole_virtual_seed0.rrd`.
    fn name(&self, origin: &Origin) -> String {
        let now = jiff::Zoned::now().strftime("%Y-%m-%dT%H-%M-%S");
        let Origin { system, config, .. } = origin;
        let safe_name = system.replace(|c: char| !c.is_alphanumeric(), "-");
        let run = format!("{now}_{safe_name}_{}_seed{}", config.clock, config.seed);
        format!("{run}.{}", self.format.extension())
    }
}

fn is_taken(error: &io::Error) -> bool {
    error.kind() == io::ErrorKind::AlreadyExists
}

/// Returns `file` with `number` before its extension; the first one has no number.
fn numbered(file: &Path, number: u32) -> PathBuf {
    if number < 2 {
        return file.to_owned();
    }
    let mut name = file.file_stem().unwrap_or_default().to_owned();
    name.push(format!("-{number}"));
    if let Some(extension) = file.extension() {
        name.push(".");
        name.push(extension);
    }
    file.with_file_name(name)
}

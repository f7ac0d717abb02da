//! The file of a recording.

use std::{
    io,
    path::{Path, PathBuf},
    sync::Arc,
};

use super::format::{BeginRun, RecordError, RecordingFormat};
use crate::run::Origin;

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

//! rerun's format, for a recorder.

use std::{
    io,
    path::{Path, PathBuf},
};

use super::{file::RecordingFile, viewer::Viewer, writer::RecordingWriter};
use crate::recorder::{BeginRun, Destination, RecordingFormat};

/// The format of rerun's files.
#[derive(Clone, Debug, Default)]
pub struct RrdFormat {
    /// The viewer that gets the recordings as well, if there is one.
    pub viewer: Option<Viewer>,
}

impl RecordingFormat for RrdFormat {
    fn extension(&self) -> &'static str {
        "rrd"
    }

    fn create(&self, path: &Path) -> io::Result<BeginRun> {
        let (file, viewer) = (RecordingFile::create(path)?, self.viewer.clone());
        Ok(Box::new(move |source| {
            let writer = RecordingWriter::start(file, viewer.as_ref(), source)?;
            Ok(Box::new(writer))
        }))
    }
}

impl From<Option<PathBuf>> for Destination {
    /// rerun's files at this place; by default in the folder `recordings`.
    fn from(place: Option<PathBuf>) -> Self {
        Self::new(place, RrdFormat::default())
    }
}

impl Default for Destination {
    fn default() -> Self {
        Self::from(None)
    }
}

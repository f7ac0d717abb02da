//! rerun's format, for a recorder.

use std::{
    io,
    path::{Path, PathBuf},
};

use super::{file::RecordingFile, viewer::Viewer, writer::RecordingWriter};
use crate::recorder::{BeginRun, Destination, RecordingFormat};

/// The format of rerun's files.
#[derive(Clone, Debug)]
pub struct RrdFormat {
    /// The viewer that gets the recordings as well, if any.
    pub viewer: Option<Viewer>,
    /// Whether the end of a recording is overdue: then it has everything recorded, but no lanes for
    /// the viewer, and is larger than necessary.
    pub is_overdue: fn() -> bool,
}

impl Default for RrdFormat {
    fn default() -> Self {
        Self {
            viewer: None,
            is_overdue: || false,
        }
    }
}

impl RecordingFormat for RrdFormat {
    fn extension(&self) -> &'static str {
        "rrd"
    }

    fn create(&self, path: &Path) -> io::Result<BeginRun> {
        let file = RecordingFile::create(path)?;
        let Self { viewer, is_overdue } = self.clone();
        Ok(Box::new(move |source| {
            let writer = RecordingWriter::start(file, viewer.as_ref(), is_overdue, source)?;
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

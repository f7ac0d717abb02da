//! Reads the rows of a recording; and rerun's format for a recorder.

use std::{
    io,
    ops::ControlFlow,
    path::{Path, PathBuf},
};

use ratelab_system::file::{self, FileError};
use thiserror::Error;

use super::{
    content::Content,
    file::RecordingFile,
    frames::{CUT_OFF, Chunks, is_rrd, quietly},
    schema::SWEEP_APPLICATION,
    viewer::Viewer,
    writer::RecordingWriter,
};
use crate::{
    check::DescriptionError,
    recorder::{BeginRun, Destination, RecordingFormat},
    run::Recording,
};

/// Maximum size of a file (bytes): half a day at 50 Hz. Reading takes about twice as much
/// memory.
const LARGEST: u64 = 1 << 30;

/// The reason why a file was not read.
#[derive(Debug, Error)]
pub enum ReadError {
    /// It cannot be opened.
    #[error("{}: {why}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        why: io::Error,
    },
    /// It contains curves of a sweep, and no run.
    #[error(
        "{file}: these are the curves of a sweep and no run: ratelab replay {file} opens them \
         in the rerun viewer",
        file = path.display()
    )]
    Sweep {
        /// The file.
        path: PathBuf,
    },
    /// Its watcher stopped the reading.
    #[error("{}: the reading was stopped", path.display())]
    Stopped {
        /// The file.
        path: PathBuf,
    },
    /// It is of another kind, or nothing in it is readable.
    #[error("{}: {what}", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// The reason.
        what: String,
    },
}

impl Recording {
    /// Reads the file at `path`, or its intact part.
    ///
    /// # Errors
    /// [`ReadError`] if it is not a recording of ratelab, or no part of it is intact.
    pub fn read(path: &Path) -> Result<Self, ReadError> {
        Self::read_watched(path, |_, _| ControlFlow::Continue(()))
    }

    /// Reads it as [`read`](Self::read) does; `watch` gets the bytes that are read so far, and
    /// their number in all, and ends the reading with a break.
    ///
    /// # Errors
    /// [`ReadError`] as there, and [`ReadError::Stopped`] after a break.
    pub fn read_watched(
        path: &Path,
        watch: impl FnMut(u64, u64) -> ControlFlow<()>,
    ) -> Result<Self, ReadError> {
        let bytes = read_file(path).map_err(|why| ReadError::File {
            path: path.to_owned(),
            why,
        })?;
        Self::parse(path, &bytes, watch)
    }

    fn parse(
        path: &Path,
        bytes: &[u8],
        mut watch: impl FnMut(u64, u64) -> ControlFlow<()>,
    ) -> Result<Self, ReadError> {
        let foreign = |what: &str| ReadError::Foreign {
            path: path.to_owned(),
            what: what.to_owned(),
        };
        if bytes.is_empty() {
            return Err(foreign(&format!("this file is empty: {KILLED}")));
        }
        if !is_rrd(bytes) {
            let what = "this is not a rerun recording: expected a .rrd file that ratelab made";
            return Err(foreign(what));
        }
        let mut chunks = Chunks::new(bytes);
        let mut content = None;
        while let Some(chunk) = chunks.next() {
            if watch((bytes.len() - chunks.left()) as u64, bytes.len() as u64).is_break() {
                return Err(ReadError::Stopped {
                    path: path.to_owned(),
                });
            }
            let added = quietly(|| Some(Content::add(&mut content, &chunk)))
                .unwrap_or(Err(DescriptionError::DamagedFile));
            added.map_err(|what| foreign(&what.to_string()))?;
        }
        let begun = content.is_some();
        if !begun && chunks.application.as_deref() == Some(SWEEP_APPLICATION) {
            return Err(ReadError::Sweep {
                path: path.to_owned(),
            });
        }
        let recording = content
            .and_then(|content| content.whole(chunks.damage))
            .ok_or_else(|| foreign(&nothing_whole(begun, chunks.damage)))?;
        Ok(Self {
            path: path.to_owned(),
            bytes: bytes.len() as u64,
            ..recording
        })
    }
}

/// What becomes of a recording before its first checkpoint.
const KILLED: &str = "a recording that is killed in its first second holds nothing of its run";

/// Returns the reason why no part of a file is intact, although it begins like a recording; `begun`
/// if it contains the description of the run.
fn nothing_whole(begun: bool, damage: Option<&str>) -> String {
    let what = match (begun, damage) {
        (true, Some(damage)) => format!("nothing in this recording is whole: {damage}"),
        (true, None) => "this recording ends before anything in it is whole".to_owned(),
        (false, Some(damage)) => format!("this recording is damaged at its beginning: {damage}"),
        (false, None) => {
            return "this is a rerun recording, but not one that ratelab made".to_owned();
        }
    };
    match damage.filter(|damage| !CUT_OFF.contains(damage)) {
        Some(_) => what,
        None => format!("{what}; {KILLED}"),
    }
}

fn read_file(path: &Path) -> io::Result<Vec<u8>> {
    file::read(path, LARGEST).map_err(|error| match error {
        FileError::Unreadable(why) => why,
        found => io::Error::other(format!(
            "expected a recording of {LARGEST} bytes at most, {found}"
        )),
    })
}

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

//! The file that a recording goes to.
//!
//! rerun's own file sink keeps errors to itself. This one remembers the first:
//! a full disk must end the recording, and say so.

use std::{
    fs::{self, File},
    io::{self, BufWriter, Seek},
    path::{Path, PathBuf},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use rerun::{
    external::re_log_encoding::{EncodeError, Encoder, EncodingOptions},
    log::LogMsg,
    sink::{LogSink, SinkFlushError},
};
use tempfile::NamedTempFile;

/// A file that rerun writes to, and what became of it. Clones are the same file.
#[derive(Clone)]
pub struct RecordingFile(Arc<Mutex<State>>);

struct State {
    path: PathBuf,
    /// The file again, to ask the system about it.
    file: File,
    /// `None` once it is complete or has failed.
    encoder: Option<Encoder<BufWriter<File>>>,
    error: Option<io::Error>,
}

impl RecordingFile {
    /// Makes a file, which must not exist yet, and the folders that lead to it.
    ///
    /// # Errors
    /// What the system says.
    pub fn create(path: &Path) -> io::Result<Self> {
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder)?;
        }
        let mut options = File::options();
        let file = options.read(true).write(true).create_new(true).open(path)?;
        let writer = BufWriter::new(file.try_clone()?);
        let version = rerun::build_info().version;
        let options = EncodingOptions::PROTOBUF_COMPRESSED;
        let encoder = Encoder::new_eager(version, options, writer).map_err(said_by_system)?;
        Ok(Self(Arc::new(Mutex::new(State {
            path: path.to_owned(),
            file,
            encoder: Some(encoder),
            error: None,
        }))))
    }

    /// Brings what was written to the system, which keeps it even if this
    /// program is killed.
    ///
    /// # Errors
    /// The first thing that went wrong, now or before.
    pub fn flush(&self) -> io::Result<()> {
        let mut state = self.state();
        state.attempt(Encoder::flush_blocking);
        if !state.is_in_place() {
            state.fail(io::Error::other("the file is gone from its folder"));
        }
        state.outcome()
    }

    /// Writes what a complete file ends with; says how long it is.
    ///
    /// # Errors
    /// The first thing that went wrong, now or before.
    pub fn complete(&self) -> io::Result<u64> {
        let mut state = self.state();
        state.attempt(|encoder| {
            encoder.finish()?;
            encoder.flush_blocking()
        });
        state.encoder = None;
        state.outcome()?;
        Ok(state.file.metadata()?.len())
    }

    /// Puts `other` in the place of this file, if that is still where it was.
    ///
    /// # Errors
    /// If it is not, or what the system says.
    pub fn replace_by(&self, other: NamedTempFile) -> io::Result<u64> {
        let state = self.state();
        if !state.is_in_place() {
            return Err(io::Error::other("the file is gone from its folder"));
        }
        let permissions = state.file.metadata()?.permissions();
        other.as_file().set_permissions(permissions)?;
        let other = other.persist(&state.path).map_err(|error| error.error)?;
        Ok(other.metadata()?.len())
    }

    /// What is in the file, from its beginning, and the folder it is in.
    ///
    /// # Errors
    /// What the system says.
    pub fn reread(&self) -> io::Result<(File, PathBuf)> {
        let state = self.state();
        let mut file = state.file.try_clone()?;
        file.rewind()?;
        let folder = state
            .path
            .parent()
            .filter(|folder| *folder != Path::new(""));
        Ok((file, folder.unwrap_or(Path::new(".")).to_owned()))
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    /// Does something to a file that is in order.
    fn attempt<T>(
        &mut self,
        what: impl FnOnce(&mut Encoder<BufWriter<File>>) -> Result<T, EncodeError>,
    ) -> Option<T> {
        let outcome = what(self.encoder.as_mut()?);
        outcome
            .map_err(|error| self.fail(said_by_system(error)))
            .ok()
    }

    /// Nothing more is written: what is there stays readable.
    fn fail(&mut self, error: io::Error) {
        self.error.get_or_insert(error);
        // Dropped in pieces: whole, it would write its end to a disk that failed.
        if let Some(Ok(writer)) = self.encoder.take().map(Encoder::into_inner) {
            let _ = writer.into_parts();
        }
    }

    /// Whether the file is still what its name is of. An open file outlives its
    /// name, and what is written to it then is lost.
    fn is_in_place(&self) -> bool {
        let named = same_file::Handle::from_path(&self.path);
        let open = self.file.try_clone().and_then(same_file::Handle::from_file);
        named.is_ok_and(|named| open.is_ok_and(|open| named == open))
    }

    fn outcome(&self) -> io::Result<()> {
        match &self.error {
            Some(error) => Err(io::Error::new(error.kind(), error.to_string())),
            None => Ok(()),
        }
    }
}

fn said_by_system(error: EncodeError) -> io::Error {
    match error {
        EncodeError::Write(error) => error,
        error => io::Error::other(error.to_string()),
    }
}

impl LogSink for RecordingFile {
    fn send(&self, message: LogMsg) {
        self.state().attempt(|encoder| encoder.append(&message));
    }

    fn flush_blocking(&self, _: Duration) -> Result<(), SinkFlushError> {
        self.flush()
            .map_err(|error| SinkFlushError::failed(error.to_string()))
    }
}

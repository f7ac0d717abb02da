//! The file of a recording, which is made small when it is complete.
//!
//! rerun's own file sink drops errors. This one keeps the first: a full disk must end the
//! recording with an error. A run is recorded in many batches, so that a kill loses little. Each
//! batch costs kilobytes: after the end of the recording they are merged.

use std::{
    collections::HashMap,
    error::Error,
    fs::{self, File},
    io::{self, BufReader, BufWriter, Seek, Write},
    path::{Path, PathBuf},
    sync::{Arc, Mutex, MutexGuard},
    time::Duration,
};

use ratelab::sync::lock;
use ratelab_system::file::{Unfinished, resolved};
use rerun::{
    EntityPath, StoreId,
    external::re_log_encoding::{DecoderApp, EncodeError, Encoder, EncodingOptions},
    log::{Chunk, LogMsg, RowId},
    sink::{LogSink, SinkFlushError},
};

use super::schema::CHECKPOINT;

/// A file for rerun's output, with its first error. Clones are handles to the same file.
#[derive(Clone)]
pub struct RecordingFile(Arc<Mutex<State>>);

struct State {
    path: PathBuf,
    /// Another handle to the file, for its metadata.
    file: File,
    /// `None` after completion or failure.
    encoder: Option<Encoder<BufWriter<File>>>,
    error: Option<io::Error>,
}

impl RecordingFile {
    /// Creates a file, which must not exist yet, and its parent folders.
    ///
    /// # Errors
    /// The error of the operating system.
    pub fn create(path: &Path) -> io::Result<Self> {
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder)?;
        }
        let mut options = File::options();
        let file = options.read(true).write(true).create_new(true).open(path)?;
        let encoder = encoder(BufWriter::new(file.try_clone()?)).map_err(system_error)?;
        Ok(Self(Arc::new(Mutex::new(State {
            path: path.to_owned(),
            file,
            encoder: Some(encoder),
            error: None,
        }))))
    }

    /// Passes all bytes to the operating system, where they survive a kill of this
    /// program.
    ///
    /// # Errors
    /// The first error, now or earlier.
    pub fn flush(&self) -> io::Result<()> {
        let mut state = self.state();
        state.attempt(Encoder::flush_blocking);
        if !state.is_in_place() {
            state.fail(io::Error::other("the file is gone from its folder"));
        }
        state.outcome()
    }

    /// Writes the end of the file; returns its size in bytes.
    ///
    /// # Errors
    /// The first error, now or earlier.
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

    /// Replaces this file by `other`, if it is still at its path.
    ///
    /// # Errors
    /// If it is not, or the error of the operating system.
    pub fn replace_by(&self, other: Unfinished) -> io::Result<u64> {
        let state = self.state();
        if !state.is_in_place() {
            return Err(io::Error::other("the file is gone from its folder"));
        }
        other.complete()?;
        Ok(state.path.metadata()?.len())
    }

    /// Returns a file that may replace this one.
    ///
    /// # Errors
    /// The error of the operating system.
    pub fn successor(&self) -> io::Result<Unfinished> {
        Unfinished::create(&resolved(&self.state().path)?)
    }

    /// Returns the file from its beginning.
    ///
    /// # Errors
    /// The error of the operating system.
    pub fn reread(&self) -> io::Result<File> {
        let mut file = self.state().file.try_clone()?;
        file.rewind()?;
        Ok(file)
    }

    /// Returns its path.
    pub fn path(&self) -> PathBuf {
        self.state().path.clone()
    }

    fn state(&self) -> MutexGuard<'_, State> {
        lock(&self.0)
    }
}

impl State {
    /// Applies a function to a file without errors.
    fn attempt<T>(
        &mut self,
        what: impl FnOnce(&mut Encoder<BufWriter<File>>) -> Result<T, EncodeError>,
    ) -> Option<T> {
        let outcome = what(self.encoder.as_mut()?);
        outcome.map_err(|error| self.fail(system_error(error))).ok()
    }

    /// Stops writing after an error; the file so far stays readable.
    fn fail(&mut self, error: io::Error) {
        self.error.get_or_insert(error);
        // Dropped in pieces: as a whole, it would write its end to the disk that failed.
        if let Some(Ok(writer)) = self.encoder.take().map(Encoder::into_inner) {
            let _ = writer.into_parts();
        }
    }

    /// Returns whether the file is still at its path. An open file outlives its path, and later
    /// writes are lost.
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

/// Returns the beginning of a file that `writer` writes.
///
/// # Errors
/// Its error.
pub fn encoder<W: Write>(writer: W) -> Result<Encoder<W>, EncodeError> {
    let version = rerun::build_info().version;
    Encoder::new_eager(version, EncodingOptions::PROTOBUF_COMPRESSED, writer)
}

fn system_error(error: EncodeError) -> io::Error {
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

/// Maximum number of rows before a new chunk is started.
const ROWS: usize = 4096;

/// Maximum size of a file to be read again at its end (bytes): half an hour in real time.
/// It is held in memory, and the user may be waiting.
pub const LARGEST: u64 = 64 << 20;

/// Merges the batches of a complete recording, unless that `is_overdue`; returns its new size in
/// bytes. The file is replaced as a whole or not at all.
///
/// # Errors
/// Any error; the file is then unchanged.
pub fn compact(recording: &RecordingFile, is_overdue: fn() -> bool) -> Result<u64, Box<dyn Error>> {
    let on_time = || {
        if is_overdue() {
            Err("somebody waits for the end")
        } else {
            Ok(())
        }
    };
    let file = recording.reread()?;
    let size = file.metadata()?.len();
    if size > LARGEST {
        return Ok(size);
    }
    let messages = DecoderApp::decode_eager(BufReader::new(file))?;
    let mut merged = Merged::default();
    for message in messages {
        on_time()?;
        merged.add(message?)?;
    }
    let whole = recording.successor()?;
    let mut encoder = encoder(BufWriter::new(whole.writer()?))?;
    for message in merged.finish() {
        on_time()?;
        encoder.append(&message?)?;
    }
    encoder.finish()?;
    encoder.flush_blocking()?;
    drop(encoder);
    Ok(recording.replace_by(whole)?)
}

/// Messages in order, with chunks merged where possible.
#[derive(Default)]
struct Merged {
    parts: Vec<CompactPart>,
    /// The newest chunk per entity and components: its place among the parts.
    newest: HashMap<ChunkKey, usize>,
}

/// A part of the file.
enum CompactPart {
    Message(LogMsg),
    Rows(StoreId, Chunk),
}

/// The properties that chunks must share to be merged: readers could not match values to
/// rows with gaps.
type ChunkKey = (EntityPath, Vec<String>);

impl Merged {
    fn add(&mut self, message: LogMsg) -> Result<(), Box<dyn Error>> {
        let rows = match &message {
            LogMsg::ArrowMsg(store, data) if store.is_recording() => {
                Some((store.clone(), Chunk::from_arrow_msg(data)?))
            }
            _ => None,
        };
        let Some((store, chunk)) = rows.filter(|(_, chunk)| !chunk.is_static()) else {
            self.parts.push(CompactPart::Message(message));
            return Ok(());
        };
        if chunk.entity_path().to_string() == CHECKPOINT {
            return Ok(()); // The end record states that the file is complete.
        }
        let mut components: Vec<String> = chunk
            .components_identifiers()
            .map(|name| name.to_string())
            .collect();
        components.sort_unstable();
        let key = (chunk.entity_path().clone(), components);
        let newest = self.newest.get(&key).map(|place| &mut self.parts[*place]);
        if let Some(CompactPart::Rows(_, before)) = newest
            && before.concatenable(&chunk)
            && before.num_rows() < ROWS
        {
            *before = Chunk::concat_and_sort(before, &chunk)?;
        } else {
            self.newest.insert(key, self.parts.len());
            self.parts.push(CompactPart::Rows(store, chunk));
        }
        Ok(())
    }

    fn finish(self) -> impl Iterator<Item = Result<LogMsg, Box<dyn Error>>> {
        self.parts.into_iter().map(|part| match part {
            CompactPart::Message(message) => Ok(message),
            CompactPart::Rows(store, chunk) => {
                // Consecutive row numbers need no space.
                let first = chunk.row_ids().next().unwrap_or_else(RowId::new);
                Ok(LogMsg::ArrowMsg(
                    store,
                    chunk.clone_as(chunk.id(), first).to_arrow_msg()?,
                ))
            }
        })
    }
}

//! Makes a complete recording small.
//!
//! A run is recorded in many batches, so that a kill loses little. Each batch costs
//! kilobytes: after the end of the recording they are merged.

use std::{
    collections::HashMap,
    error::Error,
    io::{BufReader, BufWriter},
};

use rerun::{
    EntityPath,
    external::re_log_encoding::{DecoderApp, Encoder, EncodingOptions},
    log::{Chunk, LogMsg, RowId},
};
use tempfile::NamedTempFile;

use super::{file::RecordingFile, schema::CHECKPOINT};

/// Maximum number of rows before a new chunk is started.
const ROWS: usize = 4096;

/// Maximum size of a file to be read again at its end (bytes): half an hour in real time.
/// It is held in memory, and the user may be waiting.
pub const LARGEST: u64 = 64 << 20;

/// Merges the batches of a complete recording; returns its new size in bytes. The file
/// is replaced as a whole or not at all.
///
/// # Errors
/// Any error; the file is then unchanged.
pub fn compact(recording: &RecordingFile) -> Result<u64, Box<dyn Error>> {
    let (file, folder) = recording.reread()?;
    let size = file.metadata()?.len();
    if size > LARGEST {
        return Ok(size);
    }
    let messages = DecoderApp::decode_eager(BufReader::new(file))?;
    let mut merged = Merged::default();
    for message in messages {
        merged.add(message?)?;
    }
    let file = NamedTempFile::new_in(folder)?;
    let version = rerun::build_info().version;
    let options = EncodingOptions::PROTOBUF_COMPRESSED;
    let mut encoder = Encoder::new_eager(version, options, BufWriter::new(&file))?;
    for message in merged.finish()? {
        encoder.append(&message)?;
    }
    encoder.finish()?;
    encoder.flush_blocking()?;
    drop(encoder);
    Ok(recording.replace_by(file)?)
}

/// Messages in order, with chunks merged where possible.
#[derive(Default)]
struct Merged {
    messages: Vec<LogMsg>,
    /// The growing chunk per entity and components, and the position of its message.
    growing: HashMap<ChunkKey, (usize, Chunk)>,
}

/// The properties that chunks must share to be merged: readers could not match values to
/// rows with gaps.
type ChunkKey = (EntityPath, Vec<String>);

impl Merged {
    fn add(&mut self, message: LogMsg) -> Result<(), Box<dyn Error>> {
        let LogMsg::ArrowMsg(store, data) = &message else {
            self.messages.push(message);
            return Ok(());
        };
        let chunk = Chunk::from_arrow_msg(data)?;
        if chunk.entity_path().to_string() == CHECKPOINT {
            return Ok(()); // The end record states that the file is complete.
        }
        if store.is_blueprint() || chunk.is_static() {
            self.messages.push(message);
            return Ok(());
        }
        let mut components: Vec<String> = chunk
            .components_identifiers()
            .map(|component| component.to_string())
            .collect();
        components.sort_unstable();
        let key = (chunk.entity_path().clone(), components);
        match self.growing.remove(&key) {
            Some((place, before)) if before.concatenable(&chunk) && before.num_rows() < ROWS => {
                let chunk = Chunk::concat_and_sort(&before, &chunk)?;
                self.growing.insert(key, (place, chunk));
            }
            full => {
                if let Some((place, chunk)) = full {
                    self.settle(place, &chunk)?;
                }
                let place = self.messages.len();
                self.messages.push(message);
                self.growing.insert(key, (place, chunk));
            }
        }
        Ok(())
    }

    fn settle(&mut self, place: usize, chunk: &Chunk) -> Result<(), Box<dyn Error>> {
        let first = chunk.row_ids().next().unwrap_or_else(RowId::new);
        // Consecutive row numbers need no space.
        let chunk = chunk.clone_as(chunk.id(), first);
        if let Some(LogMsg::ArrowMsg(_, data)) = self.messages.get_mut(place) {
            *data = chunk.to_arrow_msg()?;
        }
        Ok(())
    }

    fn finish(mut self) -> Result<Vec<LogMsg>, Box<dyn Error>> {
        for (place, chunk) in std::mem::take(&mut self.growing).into_values() {
            self.settle(place, &chunk)?;
        }
        Ok(self.messages)
    }
}

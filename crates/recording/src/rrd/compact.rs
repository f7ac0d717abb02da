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
    EntityPath, StoreId,
    external::re_log_encoding::DecoderApp,
    log::{Chunk, LogMsg, RowId},
};

use super::{
    file::{RecordingFile, encoder},
    schema::CHECKPOINT,
};

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

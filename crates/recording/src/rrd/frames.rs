//! The messages of a `.rrd` file, with every length checked.
//!
//! rerun's own decoder trusts every length in a file: a damaged file makes it ask for
//! more memory than there is, which ends the program. Here every length is compared with
//! the content before it is used.

use std::{
    cell::Cell,
    panic::{self, AssertUnwindSafe, catch_unwind},
    sync::Once,
};

use re_protos::{
    common::v1alpha1::Compression,
    log_msg::v1alpha1::{ArrowMsg, Encoding, SetStoreInfo},
};
use rerun::{
    external::{
        arrow::ipc::{reader::StreamReader, root_as_message},
        re_log_encoding::{
            Decodable, MessageHeader, MessageKind, StreamFooter, StreamHeader, external::lz4_flex,
        },
    },
    log::Chunk,
};

/// The first bytes of a `.rrd` file.
const MAGIC: &[u8] = b"RRF2";

/// The defect of a file that goes on after its end.
pub const MORE: &str = "something else follows its end";

/// The defects of a file that is cut off: between two messages, or within one.
pub const CUT_OFF: [&str; 2] = ["it ends too early", "it ends within a message"];

/// Maximum compression ratio of LZ4.
const LZ4_BEST_RATIO: u64 = 255;

/// The first word of an Arrow message, before its length.
const CONTINUATION: u32 = u32::MAX;

/// Returns whether `bytes` begin with the magic bytes of a `.rrd` file.
pub fn is_rrd(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC) && bytes.len() >= StreamHeader::ENCODED_SIZE_BYTES
}

/// The chunks of a `.rrd` file, up to its end or to the first damage.
pub struct Chunks<'a> {
    rest: &'a [u8],
    /// The defect that ends the chunks, if they end before the file does.
    pub damage: Option<&'static str>,
    /// Name by which the viewer groups the recording, once it is read.
    pub application: Option<String>,
}

impl<'a> Chunks<'a> {
    /// Creates the chunks of the file with the content `bytes`.
    pub fn new(bytes: &'a [u8]) -> Self {
        let rest = bytes.get(StreamHeader::ENCODED_SIZE_BYTES..);
        Self {
            rest: rest.unwrap_or_default(),
            damage: None,
            application: None,
        }
    }

    /// Returns the number of bytes that are left.
    pub fn left(&self) -> usize {
        self.rest.len()
    }

    /// Returns the next chunk; `None` at the end of the file.
    fn chunk(&mut self) -> Result<Option<Chunk>, &'static str> {
        loop {
            let (kind, content) = self.message()?;
            match kind {
                MessageKind::End if self.rest.len() > StreamFooter::ENCODED_SIZE_BYTES => {
                    return Err(MORE);
                }
                MessageKind::End => return Ok(None),
                MessageKind::SetStoreInfo => {
                    let application = quietly(|| application(content));
                    self.application = application.or(self.application.take());
                }
                MessageKind::BlueprintActivationCommand => {}
                MessageKind::ArrowMsg => {
                    return quietly(|| chunk(content))
                        .map(Some)
                        .ok_or("it holds a message that cannot be read");
                }
            }
        }
    }

    /// Returns the kind and content of the next message.
    fn message(&mut self) -> Result<(MessageKind, &'a [u8]), &'static str> {
        let header = self
            .rest
            .split_at_checked(MessageHeader::ENCODED_SIZE_BYTES);
        let (header, rest) = header.ok_or(CUT_OFF[0])?;
        let header = MessageHeader::from_rrd_bytes(header)
            .map_err(|_| "it holds something that is not a message")?;
        let length = usize::try_from(header.len).ok();
        let content = length.and_then(|length| rest.split_at_checked(length));
        let (content, rest) = content.ok_or(CUT_OFF[1])?;
        self.rest = rest;
        Ok((header.kind, content))
    }
}

impl Iterator for Chunks<'_> {
    type Item = Chunk;

    fn next(&mut self) -> Option<Chunk> {
        if self.damage.is_some() {
            return None;
        }
        let chunk = self.chunk();
        self.damage = chunk.as_ref().err().copied();
        chunk.ok().flatten()
    }
}

/// Returns the name of the application, from the message at the beginning of a recording.
fn application(content: &[u8]) -> Option<String> {
    let info = SetStoreInfo::from_rrd_bytes(content).ok()?.info?;
    Some(info.store_id?.application_id?.id)
}

/// Returns the chunk in a message; `None` if it is unreadable.
fn chunk(content: &[u8]) -> Option<Chunk> {
    let message = ArrowMsg::from_rrd_bytes(content).ok()?;
    if message.encoding() != Encoding::ArrowIpc {
        return None;
    }
    let unpacked;
    let stream = match message.compression() {
        Compression::Lz4 => {
            unpacked = unpack(&message.payload, message.uncompressed_size)?;
            &unpacked
        }
        _ => &*message.payload,
    };
    if !lengths_fit(stream) {
        return None;
    }
    let mut batches = StreamReader::try_new(stream, None).ok()?;
    Chunk::from_chunk_record_batch(&batches.next()?.ok()?).ok()
}

fn unpack(packed: &[u8], size: u64) -> Option<Vec<u8>> {
    if size > LZ4_BEST_RATIO * (packed.len() as u64 + 1) {
        return None;
    }
    let mut unpacked = vec![0; usize::try_from(size).ok()?];
    let length = lz4_flex::block::decompress_into(packed, &mut unpacked).ok()?;
    (length == unpacked.len()).then_some(unpacked)
}

/// Returns whether every length trusted by Arrow's reader fits into `stream`.
fn lengths_fit(mut stream: &[u8]) -> bool {
    while stream.len() >= size_of::<u32>() {
        match behind_message(stream) {
            Some(rest) => stream = rest,
            None => return false,
        }
    }
    true
}

/// Returns what is behind the first Arrow message of `stream`: a marker, the length of its
/// description, the description, and a body of the length stated there. Nothing is behind the end
/// of the stream.
fn behind_message(stream: &[u8]) -> Option<&[u8]> {
    let (marker, rest) = stream.split_first_chunk()?;
    let (length, rest) = rest.split_first_chunk()?;
    let length = match (u32::from_le_bytes(*marker), u32::from_le_bytes(*length)) {
        (CONTINUATION, 0) => return Some(&[]),
        (CONTINUATION, length) => length as usize,
        _ => return None,
    };
    let (description, rest) = rest.split_at_checked(length)?;
    let body = root_as_message(description).ok()?.bodyLength();
    rest.get(usize::try_from(body).ok()?..)
}

/// Returns the result of `read`; `None` also after a panic, without printing it: some of Arrow's
/// checks are assertions.
pub fn quietly<T>(read: impl FnOnce() -> Option<T>) -> Option<T> {
    thread_local! { static QUIET: Cell<bool> = const { Cell::new(false) } }
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let report = panic::take_hook();
        panic::set_hook(Box::new(move |panic| {
            if !QUIET.get() {
                report(panic);
            }
        }));
    });
    QUIET.set(true);
    let outcome = catch_unwind(AssertUnwindSafe(read));
    QUIET.set(false);
    outcome.ok().flatten()
}

//! MCAP files as rosbag2 writes them. A damaged chunk is left out, and the next one is read.

use std::{
    collections::HashMap,
    io::{self, BufRead, BufReader, Read},
};

use crc32fast::Hasher;
use mcap::{MAGIC, records::op};

use super::{
    FileReading,
    schema::{PREFIX, StampField, stamp_field},
};
use crate::bag::RawMessage;

/// The kind and length before each record.
const FRAME: u64 = 9;

/// The fields before the data of a message.
const MESSAGE_HEAD: u64 = 22;

/// Times, size, check sum and the length of a name at the head of a chunk.
const CHUNK_HEAD: usize = 32;

/// The most messages of a chunk.
const MAX_IN_CHUNK: usize = 2_000_000;

/// The longest name of a compression.
const MAX_NAME: u64 = 16;

/// The longest schema or channel (bytes).
const MAX_TEXT: u64 = 4 << 20;

/// The most schemas that are kept.
const MAX_SCHEMAS: usize = 10_000;

/// Bytes that are read at once.
const PORTION: usize = 256 << 10;

/// What is known of a channel.
#[derive(Clone, Copy, Debug)]
struct McapChannel {
    topic: usize,
    stamp: Option<StampField>,
    sequence: Sequence,
}

/// The numbers of the messages of a channel.
#[derive(Clone, Copy, Debug, Default)]
struct Sequence {
    last: u32,
    lost: u64,
    messages: u64,
    is_broken: bool,
}

impl Sequence {
    fn add(&mut self, number: u32) {
        self.messages += 1;
        if number == 0 || (self.messages > 1 && number <= self.last) {
            self.is_broken = true;
        } else if self.messages > 1 {
            self.lost += u64::from(number - self.last - 1);
        }
        self.last = number;
    }
}

/// The schemas and channels of a file.
#[derive(Default)]
struct McapContent {
    schemas: HashMap<u16, Option<StampField>>,
    channels: HashMap<u16, McapChannel>,
}

/// Returns whether a file that begins with `head` is one of MCAP.
pub fn is_mcap(head: &[u8]) -> bool {
    head.starts_with(MAGIC)
}

/// Reads a file of MCAP, which `source` is at the beginning of.
///
/// # Errors
/// The error of the operating system.
pub fn read(source: &mut (impl Read + io::Seek), reading: &mut FileReading<'_>) -> io::Result<()> {
    let all = reading.length;
    let mut source = BufReader::with_capacity(PORTION, source);
    let (mut at, mut content) = (MAGIC.len() as u64, McapContent::default());
    source.seek_relative(MAGIC.len() as i64)?;
    while at < all {
        reading.progress(at)?;
        let mut frame = [0; FRAME as usize];
        if all - at < FRAME {
            reading.damaged(format!("cut off at byte {all}"));
            break;
        }
        source.read_exact(&mut frame)?;
        let [kind, length @ ..] = frame;
        let length = u64::from_le_bytes(length);
        if kind == 0 {
            let what = format!("nothing can be read from byte {at} of {all} on");
            reading.damaged(what);
            break;
        }
        let is_whole = length <= all - at - FRAME;
        if !is_whole && kind != op::CHUNK {
            reading.damaged(format!(
                "from byte {at} of {all} on nothing could be read: a record of {length} bytes \
                 begins there"
            ));
            break;
        }
        if matches!(kind, op::DATA_END | op::FOOTER) || reading.is_full(at) {
            break;
        }
        let here = length.min(all - at - FRAME);
        content.record(kind, at, here, is_whole, &mut source, reading)?;
        at += FRAME + here;
    }
    content.finish(reading);
    Ok(())
}

impl McapContent {
    /// Reads a record of `length` bytes, from byte `at` on.
    fn record<R: Read + io::Seek>(
        &mut self,
        kind: u8,
        at: u64,
        length: u64,
        is_whole: bool,
        source: &mut BufReader<R>,
        reading: &mut FileReading<'_>,
    ) -> io::Result<()> {
        let mut rest = source.take(length);
        match kind {
            op::CHUNK => self.chunk(at, is_whole, &mut rest, reading),
            op::MESSAGE => {
                let mut data = Vec::with_capacity(64);
                let head = MESSAGE_HEAD + PREFIX as u64;
                rest.by_ref().take(head).read_to_end(&mut data)?;
                if let Some((channel, raw)) = self.message(&data, length) {
                    self.add(channel, raw, reading);
                }
            }
            op::SCHEMA | op::CHANNEL if length <= MAX_TEXT => {
                let mut data = Vec::new();
                rest.read_to_end(&mut data)?;
                self.describe(kind, &data, reading);
            }
            _ => {}
        }
        let left = i64::try_from(rest.limit()).map_err(io::Error::other)?;
        rest.into_inner().seek_relative(left)
    }

    /// Reads the records of a chunk, which begins at byte `at`.
    fn chunk(
        &mut self,
        at: u64,
        is_whole: bool,
        rest: &mut io::Take<impl BufRead>,
        reading: &mut FileReading<'_>,
    ) {
        let mut found = Vec::new();
        let length = rest.limit();
        match self.records(rest, &mut found, reading) {
            Ok(()) => {}
            Err(why) if !is_whole && why.kind() == io::ErrorKind::UnexpectedEof => {
                reading.damaged(format!(
                    "cut off in the chunk at byte {at}, of which {} messages can be read",
                    found.len()
                ));
            }
            Err(why) => {
                found.clear();
                reading.damaged(format!(
                    "the chunk of {length} bytes at byte {at} is damaged ({why}): left out"
                ));
            }
        }
        for (channel, raw) in found {
            self.add(channel, raw, reading);
        }
    }

    /// Returns the messages of a chunk, up to damage.
    fn records(
        &mut self,
        rest: &mut io::Take<impl BufRead>,
        found: &mut Vec<(u16, RawMessage)>,
        reading: &mut FileReading<'_>,
    ) -> io::Result<()> {
        let mut head = [0; CHUNK_HEAD];
        rest.read_exact(&mut head)?;
        let [crc, name] = [24, 28].map(|at| {
            head[at..]
                .first_chunk()
                .copied()
                .map_or(0, u32::from_le_bytes)
        });
        let size = head[16..]
            .first_chunk()
            .copied()
            .map_or(0, u64::from_le_bytes);
        let mut compression = Vec::new();
        rest.by_ref()
            .take(u64::from(name).min(MAX_NAME))
            .read_to_end(&mut compression)?;
        let mut records = [0; 8];
        rest.read_exact(&mut records)?;
        let content = rest.by_ref().take(u64::from_le_bytes(records));
        let content: Box<dyn Read + '_> = match &*compression {
            b"" => Box::new(content),
            b"zstd" => Box::new(zstd::Decoder::with_buffer(content)?),
            b"lz4" => Box::new(lz4::Decoder::new(content)?),
            _ => return Err(io::Error::other("of an unknown compression")),
        };
        let mut content = ChunkContent {
            source: BufReader::with_capacity(PORTION, content),
            left: size,
            crc: Hasher::new(),
        };
        while content.left > 0 {
            if found.len() >= MAX_IN_CHUNK {
                return Err(io::Error::other(format!(
                    "more than {MAX_IN_CHUNK} messages"
                )));
            }
            self.record_of_chunk(&mut content, found, reading)?;
        }
        if crc != 0 && crc != content.crc.finalize() {
            return Err(io::Error::other("its check sum is another one"));
        }
        Ok(())
    }

    /// Reads the next record of a chunk.
    fn record_of_chunk(
        &mut self,
        content: &mut ChunkContent<'_>,
        found: &mut Vec<(u16, RawMessage)>,
        reading: &mut FileReading<'_>,
    ) -> io::Result<()> {
        let mut frame = Vec::with_capacity(64);
        content.take(FRAME, &mut frame)?;
        let kind = frame[0];
        let length = frame[1..]
            .first_chunk()
            .copied()
            .map_or(0, u64::from_le_bytes);
        if length > content.left {
            return Err(io::Error::other(format!(
                "a record in it has {length} bytes"
            )));
        }
        let (mut data, wanted) = (
            frame,
            match kind {
                op::MESSAGE => length.min(MESSAGE_HEAD + PREFIX as u64),
                op::SCHEMA | op::CHANNEL if length <= MAX_TEXT => length,
                _ => 0,
            },
        );
        content.take(wanted, &mut data)?;
        content.skip(length - wanted)?;
        match kind {
            op::MESSAGE => found.extend(self.message(&data, length)),
            op::SCHEMA | op::CHANNEL => self.describe(kind, &data, reading),
            _ => {}
        }
        Ok(())
    }

    /// Takes in a schema or a channel.
    fn describe(&mut self, kind: u8, data: &[u8], reading: &mut FileReading<'_>) {
        let mut fields = Fields(data);
        match kind {
            op::SCHEMA if self.schemas.len() < MAX_SCHEMAS => {
                let (Some(id), Some(name)) = (fields.number(), fields.bytes()) else {
                    return;
                };
                let (Some(encoding), Some(text)) = (fields.bytes(), fields.bytes()) else {
                    return;
                };
                let [name, encoding] = [name, encoding].map(String::from_utf8_lossy);
                let stamp = || stamp_field(&name, &encoding, text);
                self.schemas.entry(id).or_insert_with(stamp);
            }
            op::CHANNEL => drop(self.channel(fields, reading)),
            _ => {}
        }
    }

    /// Takes in a channel with these fields; `None` if they are not whole, or it is there already.
    fn channel(&mut self, mut fields: Fields<'_>, reading: &mut FileReading<'_>) -> Option<()> {
        let (id, schema) = (fields.number()?, fields.number()?);
        if self.channels.contains_key(&id) {
            return None;
        }
        let topic = String::from_utf8_lossy(fields.bytes()?);
        let encoding = fields.bytes()?;
        let topic = reading.bag.topic(&topic)?;
        let is_encoded = |field: &StampField| match field {
            StampField::Json => encoding == b"json",
            _ => encoding == b"cdr",
        };
        let stamp = self.schemas.get(&schema).copied().flatten();
        let stamp = stamp.filter(is_encoded);
        let has_field = stamp.is_some_and(|field| field != StampField::Json);
        reading.bag.topic_mut(topic).has_stamps |= has_field;
        let sequence = Sequence::default();
        let known = McapChannel {
            topic,
            stamp,
            sequence,
        };
        self.channels.insert(id, known);
        Some(())
    }

    /// Returns the message that begins with `data`, and its channel. Its record has `length` bytes.
    fn message(&self, data: &[u8], length: u64) -> Option<(u16, RawMessage)> {
        let (channel, rest) = data.split_first_chunk()?;
        let (sequence, rest) = rest.split_first_chunk()?;
        let (log, rest) = rest.split_first_chunk()?;
        let (publish, data) = rest.split_first_chunk()?;
        let channel = u16::from_le_bytes(*channel);
        let stamp = self.channels.get(&channel)?.stamp;
        let raw = RawMessage {
            log: u64::from_le_bytes(*log),
            publish: u64::from_le_bytes(*publish),
            stamp: stamp.map_or(0, |field| field.read(data)),
            sequence: u32::from_le_bytes(*sequence),
            length: length.saturating_sub(MESSAGE_HEAD),
        };
        Some((channel, raw))
    }

    fn add(&mut self, channel: u16, raw: RawMessage, reading: &mut FileReading<'_>) {
        if let Some(channel) = self.channels.get_mut(&channel) {
            channel.sequence.add(raw.sequence);
            reading.add(channel.topic, raw);
        }
    }

    /// Notes what the numbers of messages say.
    fn finish(self, reading: &mut FileReading<'_>) {
        for channel in self.channels.into_values() {
            let Sequence {
                lost,
                messages,
                is_broken,
                ..
            } = channel.sequence;
            if messages > 1 && !is_broken {
                *reading.bag.topic_mut(channel.topic).lost.get_or_insert(0) += lost;
            }
        }
    }
}

/// The fields of a record to come. The reader of `mcap` reserves as many bytes for a text as its
/// length says, which may be a lie.
struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn number(&mut self) -> Option<u16> {
        let (number, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(u16::from_le_bytes(*number))
    }

    /// Returns bytes behind their length.
    fn bytes(&mut self) -> Option<&'a [u8]> {
        let (length, rest) = self.0.split_first_chunk()?;
        let (bytes, rest) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
        self.0 = rest;
        Some(bytes)
    }
}

/// The records of a chunk, as they were before they were compressed.
struct ChunkContent<'a> {
    source: BufReader<Box<dyn Read + 'a>>,
    /// The bytes to come, by the head of the chunk.
    left: u64,
    crc: Hasher,
}

impl ChunkContent<'_> {
    /// Replaces `data` by the next `length` bytes.
    fn take(&mut self, length: u64, data: &mut Vec<u8>) -> io::Result<()> {
        data.clear();
        let read = self.source.by_ref().take(length).read_to_end(data)?;
        self.crc.update(data);
        self.left = self.left.saturating_sub(length);
        if (read as u64) < length {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        Ok(())
    }

    /// Reads over the next `length` bytes.
    fn skip(&mut self, length: u64) -> io::Result<()> {
        self.left = self.left.saturating_sub(length);
        let mut left = length;
        while left > 0 {
            let some = self.source.fill_buf()?;
            let count = some.len().min(usize::try_from(left).unwrap_or(usize::MAX));
            if count == 0 {
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
            self.crc.update(&some[..count]);
            self.source.consume(count);
            left -= count as u64;
        }
        Ok(())
    }
}

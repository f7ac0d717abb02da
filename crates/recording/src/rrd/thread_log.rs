//! The log of the threads of the real clock, as rows of a file.
//!
//! Each row is a piece of one thread's log, with a digest of itself and of all rows before
//! it: a row that was changed, lost or exchanged is found, even if it makes no difference
//! to the run.

use std::collections::BTreeMap;

use ratelab::{Digest, Event, Time, Topology};
use ratelab_metrics::Observer;
use ratelab_re_execution::{Log, LogPosition, RunLog};
use rerun::log::{Chunk, RowId};

use super::{
    columns,
    schema::THREADS,
    timeline::{BatchStream, Written},
};
use crate::run::ThreadLog;

/// Components of a piece: its number from zero, that of its thread (the supervisor's is 0, then
/// come the nodes), the piece, and the digest of it and all before.
const ROW: &str = "piece";
const THREAD: &str = "thread";
const BYTES: &str = "bytes";
const DIGEST: &str = "digest";

/// What is wrong with a log whose digests do not fit.
const CHANGED: &str = "a piece of it is missing or was changed";

/// Writes the log of a run.
#[derive(Default)]
pub struct ThreadTrack {
    position: LogPosition,
    written: u64,
    digest: Option<u64>,
}

impl ThreadTrack {
    /// Returns what is new, each piece with its thread.
    pub fn take(&mut self, observer: &Observer) -> Vec<(usize, Vec<u8>)> {
        RunLog::attach(observer).since(&mut self.position)
    }

    /// Writes `pieces` at run time `now`.
    pub fn write(
        &mut self,
        stream: &BatchStream,
        pieces: &[(usize, Vec<u8>)],
        now: Time,
    ) -> Written {
        let first = self.written;
        self.written += pieces.len() as u64;
        let digests: Vec<u64> = pieces
            .iter()
            .zip(first..)
            .map(|((thread, bytes), row)| {
                let digest = digest(self.digest, row, *thread as u64, bytes);
                self.digest = Some(digest);
                digest
            })
            .collect();
        let threads = pieces.iter().map(|(thread, _)| *thread as u64);
        let columns = [
            columns::numbers(ROW, first..self.written)?,
            columns::numbers(THREAD, threads)?,
            columns::bytes(BYTES, pieces.iter().map(|(_, bytes)| &**bytes))?,
            columns::numbers(DIGEST, digests)?,
        ];
        stream.send(THREADS, &vec![now; pieces.len()], columns)
    }

    /// Returns the digest of all that is written; `None` before the first piece.
    pub fn digest(&self) -> Option<u64> {
        self.digest
    }
}

/// Returns the digest of a row after one with digest `before`.
fn digest(before: Option<u64>, row: u64, thread: u64, bytes: &[u8]) -> u64 {
    let head = [before.unwrap_or(0), row, thread].map(u64::to_le_bytes);
    let digest = Digest::new(&[head.as_flattened(), bytes].concat()).to_string();
    u64::from_str_radix(&digest[..16], 16).unwrap_or_default()
}

/// The pieces of a file so far.
#[derive(Default)]
pub struct LogPieces(BTreeMap<RowId, LogPiece>);

/// A piece: tools for rerun's files keep its bytes and its numbers in different chunks.
#[derive(Default)]
struct LogPiece {
    /// Its number, thread and digest.
    numbers: Option<[u64; 3]>,
    bytes: Option<Vec<u8>>,
}

impl LogPieces {
    /// Adds the rows in `chunk`.
    pub fn add(&mut self, chunk: &Chunk) {
        let [rows, threads, digests] =
            [ROW, THREAD, DIGEST].map(|name| columns::cells(chunk, name));
        let bytes = columns::read_bytes(chunk, BYTES);
        for (index, id) in chunk.row_ids().enumerate() {
            let piece = self.0.entry(id).or_default();
            let number = |cells: &[Option<Option<u64>>]| cells[index].flatten();
            let numbers = [number(&rows), number(&threads), number(&digests)];
            if let [Some(row), Some(thread), Some(digest)] = numbers {
                piece.numbers = Some([row, thread, digest]);
            }
            if let Some(bytes) = &bytes[index] {
                piece.bytes = Some(bytes.clone());
            }
        }
    }

    /// Returns the log of a run with this `topology` and these `events`, if any; `end` is the
    /// digest in the end record.
    pub fn finish(
        self,
        topology: &Topology,
        events: &[Event],
        end: Option<Option<u64>>,
    ) -> Option<ThreadLog> {
        let (mut log, mut last) = (Log::default(), None);
        let all = self.0.len();
        let mut pieces: Vec<_> = self
            .0
            .into_values()
            .filter_map(|piece| piece.numbers.zip(piece.bytes))
            .collect();
        let mut sound = pieces.len() == all;
        pieces.sort_by_key(|([row, ..], _)| *row);
        for (([row, thread, of], bytes), expected) in pieces.into_iter().zip(0..) {
            if thread <= topology.nodes.len() as u64
                && row == expected
                && of == digest(last, row, thread, &bytes)
            {
                log.add(thread as usize, &bytes);
            } else {
                sound = false;
            }
            last = Some(of);
        }
        sound &= end.is_none_or(|end| end == last);
        let some = !sound || !log.is_empty();
        some.then(|| ThreadLog {
            log,
            events: events.to_vec(),
            damage: (!sound).then_some(CHANGED),
        })
    }
}

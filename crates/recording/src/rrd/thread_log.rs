//! The log of the threads of the real clock, as rows of a file.
//!
//! Each row is a piece of one thread's log, with a digest of itself and of all rows before
//! it: a row that was changed, lost or exchanged is found, even if it makes no difference
//! to the run.

use ratelab::{Event, Time, Topology};
use ratelab_account::Observer;
use ratelab_effects::Digest;
use ratelab_replay::{Log, LogPosition, RunLog};
use rerun::log::Chunk;

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
    /// What is new, each piece with its thread.
    pub fn take(&mut self, observer: &Observer) -> Vec<(usize, Vec<u8>)> {
        RunLog::of(observer).since(&mut self.position)
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
        let digests = pieces.iter().zip(first..).map(|((thread, bytes), row)| {
            let digest = digest(self.digest, row, *thread as u64, bytes);
            self.digest = Some(digest);
            digest
        });
        let digests: Vec<u64> = digests.collect();
        let threads = pieces.iter().map(|(thread, _)| *thread as u64);
        let columns = [
            columns::numbers(ROW, first..self.written)?,
            columns::numbers(THREAD, threads)?,
            columns::bytes(BYTES, pieces.iter().map(|(_, bytes)| &**bytes))?,
            columns::numbers(DIGEST, digests)?,
        ];
        stream.send(THREADS, &vec![now; pieces.len()], columns)
    }

    /// The digest of all that is written; `None` before the first piece.
    pub fn digest(&self) -> Option<u64> {
        self.digest
    }
}

/// The digest of a row after one with digest `before`.
fn digest(before: Option<u64>, row: u64, thread: u64, bytes: &[u8]) -> u64 {
    let head = [before.unwrap_or(0), row, thread].map(u64::to_le_bytes);
    let digest = Digest::of(&[head.as_flattened(), bytes].concat()).to_string();
    u64::from_str_radix(&digest[..16], 16).unwrap_or_default()
}

/// The pieces of a file so far, each with its number, thread and digest; `None` for a damaged
/// one.
#[derive(Default)]
pub struct LogPieces(Vec<Option<([u64; 3], Vec<u8>)>>);

impl LogPieces {
    /// Adds the rows in `chunk`.
    pub fn add(&mut self, chunk: &Chunk) {
        let [rows, threads, digests] =
            [ROW, THREAD, DIGEST].map(|name| columns::cells(chunk, name));
        let bytes = columns::read_bytes(chunk, BYTES).into_iter().enumerate();
        self.0.extend(bytes.map(|(index, bytes)| {
            let number = |cells: &[Option<Option<u64>>]| cells[index].flatten();
            let numbers = [number(&rows)?, number(&threads)?, number(&digests)?];
            Some((numbers, bytes?))
        }));
    }

    /// The log of a run with this `topology` and these `events`, if there is one; `end` is
    /// the digest in the end record.
    pub fn finish(
        self,
        topology: &Topology,
        events: &[Event],
        end: Option<Option<u64>>,
    ) -> Option<ThreadLog> {
        let (mut log, mut last) = (Log::default(), None);
        let mut sound = self.0.iter().all(Option::is_some);
        let mut pieces: Vec<_> = self.0.into_iter().flatten().collect();
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

//! The log of the threads of the real clock, as rows of a file.
//!
//! Each row is a piece of one thread's log, with a digest of itself and of all rows before
//! it: a row that was changed, lost or exchanged is found, even if it makes no difference
//! to the run.

use ratelab::{Event, Time, Topology};
use ratelab_account::Observer;
use ratelab_effects::Digest;
use ratelab_replay::{Log, LogPosition, RunLog};
use rerun::{RecordingStream, RecordingStreamResult, log::Chunk};

use super::{
    columns,
    rows::{self, LogPiece},
    schema::{THREADS, piece},
    timeline::Stamps,
};

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

    /// Writes `pieces`; `stamps` has the run time of each.
    pub fn write(
        &mut self,
        rec: &RecordingStream,
        pieces: &[(usize, Vec<u8>)],
        stamps: &Stamps,
    ) -> RecordingStreamResult<()> {
        if pieces.is_empty() {
            return Ok(());
        }
        let first = self.written;
        self.written += pieces.len() as u64;
        let digests = pieces.iter().zip(first..).map(|((thread, bytes), row)| {
            let digest = digest(self.digest, row, *thread as u64, bytes);
            self.digest = Some(digest);
            digest
        });
        let digests: Vec<u64> = digests.collect();
        let columns = [
            columns::numbers(piece::ROW, first..self.written)?,
            columns::numbers(
                piece::THREAD,
                pieces.iter().map(|(thread, _)| *thread as u64),
            )?,
            columns::bytes(piece::BYTES, pieces.iter().map(|(_, bytes)| &**bytes))?,
            columns::numbers(piece::DIGEST, digests)?,
        ];
        rec.send_columns(THREADS, stamps.columns(), columns)
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

/// The rows of a file so far.
#[derive(Default)]
pub struct Pieces {
    rows: Vec<Option<LogPiece>>,
}

/// The log in a file.
#[derive(Clone, Debug)]
pub struct ThreadLog {
    /// The log.
    pub log: Log,
    /// All events of the file: those of a damaged one may be more than a
    /// [`Recording`](super::Recording) has.
    pub events: Vec<Event>,
    /// What is wrong with it, if anything is.
    pub damage: Option<&'static str>,
}

impl Pieces {
    /// Adds the rows in `chunk`.
    pub fn add(&mut self, chunk: &Chunk) {
        self.rows.extend(rows::pieces(chunk));
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
        let mut damage = self.rows.iter().any(Option::is_none).then_some(CHANGED);
        let mut rows: Vec<LogPiece> = self.rows.into_iter().flatten().collect();
        rows.sort_by_key(|piece| piece.row);
        for (piece, row) in rows.into_iter().zip(0..) {
            let known = usize::try_from(piece.thread).ok();
            let known = known.filter(|thread| *thread <= topology.nodes.len());
            let sound =
                piece.row == row && piece.digest == digest(last, row, piece.thread, &piece.bytes);
            match known.filter(|_| sound) {
                Some(thread) => log.add(thread, &piece.bytes),
                None => damage = Some(CHANGED),
            }
            last = Some(piece.digest);
        }
        if end.is_some_and(|end| end != last) {
            damage = Some(CHANGED);
        }
        let events = events.to_vec();
        let some = damage.is_some() || !log.is_empty();
        some.then_some(ThreadLog {
            log,
            events,
            damage,
        })
    }
}

/// Run times for `pieces` that were written at `now`.
pub fn times(pieces: &[(usize, Vec<u8>)], now: Time) -> impl Iterator<Item = Time> {
    std::iter::repeat_n(now, pieces.len())
}

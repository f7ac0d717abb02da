//! The log of a run: what each thread did, entry by entry, as bytes, and how they come while it
//! goes on.

use std::{any::Any, collections::BTreeMap};

use ratelab::{
    RunState, Time,
    journal::{End, Entry, Journal, LockName, Operation, ThreadJournal},
    sync::{
        Arc, Mutex,
        atomic::{AtomicUsize, Ordering},
        lock,
    },
};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// The log of a run, as far as it was under the real clock: what each thread did, when,
/// and in which turns it took what the nodes share.
///
/// Together with the configuration and the events of the run it is enough to execute the
/// run again; see [`ReExecution`](crate::ReExecution).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Log {
    threads: Vec<Vec<u8>>,
}

/// A position in the log of a run, to read it piece by piece.
#[derive(Clone, Debug, Default)]
pub struct LogPosition(pub(super) Vec<usize>);

/// Why a run cannot be executed again.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum LogError {
    /// The bytes are no log.
    #[error("the log of its threads is damaged: {0}")]
    Damaged(String),
    /// The log is of an earlier release.
    #[error(
        "its threads were logged by an earlier ratelab: verify it with that one, or record it anew"
    )]
    Earlier,
    /// No run can have been like this.
    #[error("no run can have the order in the log of its threads: {0}")]
    Impossible(String),
    /// Something that no log holds has changed the run.
    #[error("this run cannot come back: {0} was written to from outside of the graph")]
    Outside(String),
}

impl Log {
    /// The most memory for the log of a run (bytes): ten hours of a default run. What
    /// comes later is not logged.
    pub(super) const MAX_BYTES: usize = 64 << 20;

    /// Adds bytes of a thread: 0 is the thread that supervises, then come the nodes in the
    /// order of their addition.
    pub fn add(&mut self, thread: usize, bytes: &[u8]) {
        if self.threads.len() <= thread {
            self.threads.resize(thread + 1, Vec::new());
        }
        self.threads[thread].extend_from_slice(bytes);
    }

    /// Returns whether the run was never under the real clock, or has no log.
    pub fn is_empty(&self) -> bool {
        self.threads.is_empty()
    }

    /// Returns whether the log was too long, so that it ends before the run.
    pub fn is_full(&self) -> bool {
        self.threads.iter().map(Vec::len).sum::<usize>() > Self::MAX_BYTES
    }

    /// Returns the bytes of the threads.
    pub fn threads(&self) -> &[Vec<u8>] {
        &self.threads
    }
}

impl FromIterator<(usize, Vec<u8>)> for Log {
    fn from_iter<I: IntoIterator<Item = (usize, Vec<u8>)>>(pieces: I) -> Self {
        let mut log = Self::default();
        for (thread, bytes) in pieces {
            log.add(thread, &bytes);
        }
        log
    }
}

/// The first byte of a thread's log; logs of earlier releases begin with a smaller one.
const FORMAT: u8 = 2;

/// The log of a thread up to some entry: numbers count from the last one.
#[derive(Debug, Default)]
pub(super) struct Coder {
    bytes: Vec<u8>,
    last: Time,
    locks: Vec<LockName>,
    /// The next turn of each lock, if no other thread took one.
    turns: Vec<u64>,
    /// The locks of the last entry that had some, by their positions.
    pattern: Vec<usize>,
    line: LogLine,
}

/// An entry as it is written.
#[derive(Debug, Default, Serialize, Deserialize)]
struct LogLine {
    /// Names of locks that are new with it.
    names: Vec<String>,
    /// Its times count from the entry before.
    entry: Entry,
    /// The positions of the locks that it took; `None` for the same locks as the last entry
    /// with locks.
    locks: Option<Vec<usize>>,
    /// For each of them, twice the number of turns that others took meanwhile; one more after an
    /// access from outside.
    turns: Vec<u64>,
}

impl Coder {
    /// Returns the next turn of each known lock, if no other thread took one.
    pub(super) fn turns(&self) -> impl Iterator<Item = (LockName, u64)> {
        self.locks.iter().copied().zip(self.turns.iter().copied())
    }

    /// Returns what was put so far.
    pub(super) fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Adds an entry and its operations; returns their number of bytes.
    pub(super) fn put(&mut self, entry: &Entry, operations: &[Operation]) -> usize {
        let before = self.bytes.len();
        if before == 0 {
            self.bytes.push(FORMAT);
        }
        self.line.names.clear();
        self.line.turns.clear();
        let mut locks = Vec::with_capacity(operations.len());
        for operation in operations {
            let lock = self.position(operation.lock);
            let ahead = operation.turn.wrapping_sub(self.turns[lock]);
            self.line
                .turns
                .push(ahead << 1 | u64::from(operation.outside));
            self.turns[lock] = operation.turn + 1;
            locks.push(lock);
        }
        let is_usual = !locks.is_empty() && locks == self.pattern;
        self.line.locks = (!is_usual).then(|| locks.clone());
        let last = self.last.as_nanos();
        self.line.entry = *entry;
        for time in times(&mut self.line.entry) {
            let ahead = time.as_nanos().wrapping_sub(last) as i64;
            // Small numbers for times before the last one, too.
            *time = Time::from_nanos((ahead << 1 ^ ahead >> 63) as u64);
        }
        let bytes = postcard::to_extend(&self.line, std::mem::take(&mut self.bytes));
        self.bytes = bytes.expect("a vector takes every number and text");
        self.pass(entry, locks);
        self.bytes.len() - before
    }

    /// Moves on behind an entry that took these `locks`.
    fn pass(&mut self, entry: &Entry, locks: Vec<usize>) {
        self.last = entry.at().unwrap_or(self.last);
        if !locks.is_empty() {
            self.pattern = locks;
        }
    }

    /// Returns the position of a lock; names it before its first use.
    fn position(&mut self, lock: LockName) -> usize {
        let known = self.locks.iter().position(|known| *known == lock);
        known.unwrap_or_else(|| {
            self.line.names.push(lock.text().to_string());
            self.locks.push(lock);
            self.turns.push(0);
            self.locks.len() - 1
        })
    }

    /// Returns the entries in the log of a thread, each with its operations.
    ///
    /// # Errors
    /// [`LogError`] for bytes that are no log, or that of an earlier release.
    pub(super) fn read(bytes: &[u8]) -> Result<Vec<(Entry, Vec<Operation>)>, LogError> {
        let mut rest = match bytes {
            [FORMAT, rest @ ..] => rest,
            [] => return Ok(Vec::new()),
            [..FORMAT, ..] => return Err(LogError::Earlier),
            _ => return Err(LogError::Damaged("byte 0 of a thread".to_owned())),
        };
        let (mut coder, mut entries) = (Self::default(), Vec::new());
        while !rest.is_empty() {
            let at = bytes.len() - rest.len();
            let logged = coder.get(&mut rest);
            let damaged = || LogError::Damaged(format!("byte {at} of a thread"));
            entries.push(logged.ok_or_else(damaged)?);
        }
        Ok(entries)
    }

    /// Reads an entry with its operations; `None` where there is none.
    fn get(&mut self, bytes: &mut &[u8]) -> Option<(Entry, Vec<Operation>)> {
        let (line, rest): (LogLine, _) = postcard::take_from_bytes(bytes).ok()?;
        *bytes = rest;
        for name in &line.names {
            self.locks.push(LockName::new(name));
            self.turns.push(0);
        }
        let locks = line.locks.unwrap_or_else(|| self.pattern.clone());
        if locks.len() != line.turns.len() {
            return None;
        }
        let mut operations = Vec::with_capacity(locks.len());
        for (lock, ahead) in locks.iter().zip(line.turns) {
            let next = self.turns.get_mut(*lock)?;
            let turn = next.checked_add(ahead >> 1)?;
            *next = turn.checked_add(1)?;
            operations.push(Operation {
                lock: self.locks[*lock],
                turn,
                outside: ahead & 1 != 0,
            });
        }
        let last = self.last.as_nanos();
        let mut entry = line.entry;
        for time in times(&mut entry) {
            let ahead = time.as_nanos();
            *time = Time::from_nanos(last.wrapping_add(ahead >> 1 ^ (ahead & 1).wrapping_neg()));
        }
        self.pass(&entry, locks);
        Some((entry, operations))
    }
}

/// Returns the times of an entry.
fn times(entry: &mut Entry) -> impl Iterator<Item = &mut Time> {
    let times = match entry {
        Entry::Arrive(arrival) => [Some(&mut arrival.at), None],
        Entry::Look { at, late, .. } => [Some(at), late.as_mut().map(|late| &mut late.until)],
        Entry::Done { at, missed_before } => [Some(at), Some(missed_before)],
        Entry::Finish { at, .. }
        | Entry::Obey { at, .. }
        | Entry::End(
            End::Completed { until: at }
            | End::Ended { at, .. }
            | End::Failed { at, .. }
            | End::NoThread { at, .. },
        ) => [Some(at), None],
        _ => [None, None],
    };
    times.into_iter().flatten()
}

/// The log of a run, as far as it was under the real clock: the supervisor's, then one per
/// node. Beyond a limit the rest of the run is not logged.
///
/// ```
/// use ratelab::{Clock, Graph, Hz, Inbox, Tick, Time};
/// use ratelab_real_clock::RealClock;
/// use ratelab_re_execution::RunLog;
///
/// let mut graph = Graph::new();
/// graph.node("a", Hz::new(500.0)?, 0, |_| |_: &mut Tick| {})?;
/// let log = RunLog::attach(&graph.state());
/// RealClock::default().run(&mut graph, &mut Inbox::default(), Time::from_nanos(9_000_000))?;
/// assert!(!log.log().is_empty());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Default)]
pub struct RunLog {
    streams: Mutex<Vec<Arc<Stream>>>,
    totals: Arc<LogTotals>,
}

/// What is of all threads together.
#[derive(Debug, Default)]
struct LogTotals {
    /// Number of bytes.
    size: AtomicUsize,
    outside: Mutex<OutsideWrites>,
}

/// The log of one thread.
#[derive(Debug, Default)]
struct Stream {
    totals: Arc<LogTotals>,
    coder: Mutex<Coder>,
}

/// Writes of threads outside of the graph to what its nodes share.
#[derive(Debug, Default)]
struct OutsideWrites {
    /// The next turn of each lock at the beginning of the stretch: before it anybody may
    /// have been there.
    firsts: BTreeMap<LockName, u64>,
    /// The locks that were taken from outside during a stretch.
    taken: Vec<LockName>,
}

impl OutsideWrites {
    fn note(&mut self, operation: &Operation) {
        let first = self.firsts.get(&operation.lock).copied().unwrap_or(0);
        if operation.turn != first && !self.taken.contains(&operation.lock) {
            self.taken.push(operation.lock);
        }
    }
}

impl RunLog {
    /// Returns the log of a run, from now on if it had none. Beside a journal of another kind it
    /// stays empty.
    pub fn attach(run: &RunState) -> Arc<Self> {
        let journal: Arc<dyn Any + Send + Sync> = run.journal_or(|| Arc::<Self>::default());
        journal.downcast().unwrap_or_default()
    }

    /// Returns the log of thread number `thread`.
    fn stream(&self, thread: usize) -> Arc<Stream> {
        let mut streams = lock(&self.streams);
        while streams.len() <= thread {
            streams.push(Arc::new(Stream {
                totals: self.totals.clone(),
                coder: Mutex::default(),
            }));
        }
        streams[thread].clone()
    }

    /// Returns the log of the run so far, as far as it was under the real clock.
    pub fn log(&self) -> Log {
        let pieces = self.since(&mut LogPosition::default());
        pieces.into_iter().collect()
    }

    /// Returns the names of the topics and [`Shared`](ratelab::Shared) values that a thread outside
    /// of the graph wrote to while the graph was under the real clock: such a run cannot come back.
    /// Each is known as soon as a node has been there next.
    pub fn written_from_outside(&self) -> Vec<std::sync::Arc<str>> {
        let outside = lock(&self.totals.outside);
        outside.taken.iter().map(|name| name.text()).collect()
    }

    /// Returns what the threads did after `position`: bytes for a [`Log`], each piece with the
    /// number of its thread. Moves the position to the end. Events that these mention are in the
    /// events of the run afterwards.
    pub fn since(&self, position: &mut LogPosition) -> Vec<(usize, Vec<u8>)> {
        let streams = lock(&self.streams).clone();
        position.0.resize(streams.len(), 0);
        let pieces =
            streams
                .iter()
                .zip(&mut position.0)
                .enumerate()
                .map(|(thread, (stream, known))| {
                    let coder = lock(&stream.coder);
                    let piece = coder.bytes()[*known..].to_vec();
                    *known = coder.bytes().len();
                    (thread, piece)
                });
        pieces.filter(|(_, piece)| !piece.is_empty()).collect()
    }
}

impl Journal for RunLog {
    fn begin(&self, nodes: usize) {
        let mut firsts = BTreeMap::new();
        for stream in &*lock(&self.streams) {
            for (name, next) in lock(&stream.coder).turns() {
                let first = firsts.entry(name).or_insert(next);
                *first = next.max(*first);
            }
        }
        lock(&self.totals.outside).firsts = firsts;
        for thread in 0..=nodes {
            self.stream(thread).add(&Entry::Begin, &[]);
        }
    }

    fn thread(&self, thread: usize) -> Arc<dyn ThreadJournal> {
        self.stream(thread)
    }
}

impl ThreadJournal for Stream {
    fn add(&self, entry: &Entry, turns: &[Operation]) {
        if self.totals.size.load(Ordering::Relaxed) > Log::MAX_BYTES {
            return;
        }
        for operation in turns.iter().filter(|operation| operation.outside) {
            lock(&self.totals.outside).note(operation);
        }
        let more = lock(&self.coder).put(entry, turns);
        self.totals.size.fetch_add(more, Ordering::Relaxed);
    }
}

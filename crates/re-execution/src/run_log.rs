//! The log of a run while it goes on.

use std::{any::Any, collections::BTreeMap};

use ratelab::{
    RunState,
    journal::{Entry, Journal, LockName, Operation, ThreadJournal},
    sync::{
        Arc, Mutex,
        atomic::{AtomicUsize, Ordering},
        lock,
    },
};

use super::log::{Log, LogPosition};
use crate::log::Coder;

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

//! The log of a run while it goes on.

use std::collections::BTreeMap;

use super::{
    entry::{Coder, Entry},
    lock_name::LockName,
    log::{Log, LogPosition},
    turns::{Noter, Operation},
};
use crate::sync::{
    Arc, Mutex,
    atomic::{AtomicUsize, Ordering},
    lock,
};

/// The log of a run, as far as it was under the real clock: the supervisor's, then one per
/// node. Beyond a limit the rest of the run is not logged.
#[derive(Debug, Default)]
pub(crate) struct RunLog {
    streams: Mutex<Vec<Arc<Stream>>>,
    size: Arc<AtomicUsize>,
    outside: Arc<Mutex<OutsideWrites>>,
}

/// The log of one thread.
#[derive(Debug, Default)]
pub(crate) struct Stream {
    size: Arc<AtomicUsize>,
    outside: Arc<Mutex<OutsideWrites>>,
    content: Mutex<StreamData>,
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

#[derive(Debug, Default)]
struct StreamData {
    coder: Coder,
    bytes: Vec<u8>,
}

impl RunLog {
    /// Begins a stretch with `nodes` threads; returns the log of the supervisor.
    pub(crate) fn begin(&self, nodes: usize) -> Arc<Stream> {
        let mut firsts = BTreeMap::new();
        for stream in &*lock(&self.streams) {
            for (name, next) in lock(&stream.content).coder.turns() {
                let first = firsts.entry(name).or_insert(next);
                *first = next.max(*first);
            }
        }
        lock(&self.outside).firsts = firsts;
        for thread in 0..=nodes {
            self.stream(thread).note_alone(Entry::Begin);
        }
        self.stream(0)
    }

    /// The log of thread number `thread`.
    pub(crate) fn stream(&self, thread: usize) -> Arc<Stream> {
        let mut streams = lock(&self.streams);
        while streams.len() <= thread {
            streams.push(Arc::new(Stream {
                size: self.size.clone(),
                outside: self.outside.clone(),
                content: Mutex::default(),
            }));
        }
        streams[thread].clone()
    }

    /// The names of the shared values that a thread outside of the graph wrote to while
    /// the graph was under the real clock.
    pub(crate) fn written_from_outside(&self) -> Vec<std::sync::Arc<str>> {
        let outside = lock(&self.outside);
        outside.taken.iter().map(|name| name.text()).collect()
    }

    /// The bytes after `position`, each piece with the number of its thread; moves the
    /// position to the end.
    pub(crate) fn since(&self, position: &mut LogPosition) -> Vec<(usize, Vec<u8>)> {
        let streams = lock(&self.streams).clone();
        position.0.resize(streams.len(), 0);
        let pieces = streams.iter().zip(&mut position.0).enumerate();
        let pieces = pieces.map(|(thread, (stream, known))| {
            let content = lock(&stream.content);
            let piece = content.bytes[*known..].to_vec();
            *known = content.bytes.len();
            (thread, piece)
        });
        pieces.filter(|(_, piece)| !piece.is_empty()).collect()
    }
}

impl Stream {
    /// Adds an entry of this thread, with the operations that it noted since its last one.
    pub(crate) fn note(&self, entry: Entry) {
        Noter::take(|operations| self.add(&entry, operations));
    }

    /// Adds an entry of a thread without operations.
    pub(crate) fn note_alone(&self, entry: Entry) {
        self.add(&entry, &[]);
    }

    /// Adds an entry of this thread with its `operations`.
    pub(crate) fn add(&self, entry: &Entry, operations: &[Operation]) {
        if self.size.load(Ordering::Relaxed) > Log::MOST {
            return;
        }
        for operation in operations.iter().filter(|operation| operation.outside) {
            lock(&self.outside).note(operation);
        }
        let mut content = lock(&self.content);
        let StreamData { coder, bytes } = &mut *content;
        let before = bytes.len();
        coder.put(bytes, entry, operations);
        self.size.fetch_add(bytes.len() - before, Ordering::Relaxed);
    }
}

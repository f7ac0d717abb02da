//! The log of a run as bytes.

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

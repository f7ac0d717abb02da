//! Writes a running experiment to a file, on a thread of its own.
//!
//! The run never waits for it but in virtual time, where waiting costs nothing.
//! What came faster than it could be taken is counted.

use std::{
    cell::Cell,
    io,
    path::{Path, PathBuf},
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    thread::{self, JoinHandle},
    time::Duration,
};

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, bounded};
use thiserror::Error;

use super::{
    compact::compact,
    file::RecordingFile,
    source::{Source, StopReason},
    writer::{AttachedTaps, RecordingWriter, Written},
};

/// Wall time between two looks at the taps.
const LOOK: Duration = Duration::from_millis(50);

/// Why a recording ended before it was to.
#[derive(Debug, Error)]
#[error("the recording {} ended early: {why}", path.display())]
pub struct RecordError {
    /// The file, which is readable up to its last second.
    pub path: PathBuf,
    /// What the system said.
    pub why: io::Error,
}

/// A recording that is complete.
#[derive(Clone, Debug)]
pub struct Recorded {
    /// The file.
    pub path: PathBuf,
    /// Its size in bytes.
    pub bytes: u64,
    /// Messages in it.
    pub messages: u64,
    /// Messages and ticks that came faster than they could be recorded.
    pub lost: u64,
}

/// A recording that is being made.
pub struct Recorder {
    path: PathBuf,
    reason: Sender<StopReason>,
    /// Whether it was asked to end.
    asked: Cell<bool>,
    lost: Arc<AtomicU64>,
    thread: JoinHandle<io::Result<Recorded>>,
}

impl Recorder {
    /// Records a run that has not begun, from its first tick, to the new file
    /// `path`.
    ///
    /// # Errors
    /// What the system says of the file.
    pub fn from_the_start(path: &Path, source: &Source) -> io::Result<Self> {
        let attached = AttachedTaps::new(source);
        Self::start(path, source, move |_| attached)
    }

    /// Records a run that may have begun, from some moment soon. Never waits for
    /// it.
    ///
    /// # Errors
    /// What the system says of the file.
    pub fn midway(path: &Path, source: &Source) -> io::Result<Self> {
        // A topic lets nobody in while it waits for a full tap, and the caller
        // may be who is to empty that.
        Self::start(path, source, AttachedTaps::new)
    }

    fn start(
        path: &Path,
        source: &Source,
        attach: impl FnOnce(&Source) -> AttachedTaps + Send + 'static,
    ) -> io::Result<Self> {
        let file = RecordingFile::create(path)?;
        let (reason, asked) = bounded(1);
        let lost = Arc::<AtomicU64>::default();
        let (to, source, losses) = (path.to_owned(), source.clone(), lost.clone());
        let thread = thread::Builder::new().name("recorder".to_owned());
        let thread = thread.spawn(move || {
            let attached = attach(&source);
            let writer = RecordingWriter::start(file, attached, source, losses)?;
            let written = record(writer, &asked)?;
            Ok(Recorded {
                // If that cannot be done, the file is complete all the same.
                bytes: compact(&written.file).unwrap_or(written.bytes),
                messages: written.messages,
                lost: written.lost,
                path: to,
            })
        })?;
        Ok(Self {
            path: path.to_owned(),
            reason,
            asked: Cell::new(false),
            lost,
            thread,
        })
    }

    /// Messages and ticks that came faster than they could be recorded.
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }

    /// Asks it to end; the first to ask is heard.
    pub fn end(&self, reason: StopReason) {
        self.asked.set(true);
        let _ = self.reason.try_send(reason);
    }

    /// Whether it was asked to end, or has ended of itself.
    pub fn is_ending(&self) -> bool {
        self.asked.get() || self.has_ended()
    }

    /// Whether it has ended, as asked or because it could not go on.
    pub fn has_ended(&self) -> bool {
        self.thread.is_finished()
    }

    /// Waits for its end, which must have been asked for.
    ///
    /// # Errors
    /// [`RecordError`] if it could not be completed.
    pub fn finish(self) -> Result<Recorded, RecordError> {
        let Self {
            path,
            reason,
            thread,
            ..
        } = self;
        drop(reason);
        let panicked = |_| Err(io::Error::other("the recorder panicked, which is a defect"));
        let outcome = thread.join().unwrap_or_else(panicked);
        outcome.map_err(|why| RecordError { path, why })
    }
}

/// Writes until asked to end.
fn record(mut writer: RecordingWriter, asked: &Receiver<StopReason>) -> io::Result<Written> {
    let mut wait = LOOK;
    loop {
        match asked.recv_timeout(wait) {
            Ok(reason) => return writer.complete(&reason),
            Err(RecvTimeoutError::Disconnected) => return writer.complete(&StopReason::Off),
            Err(RecvTimeoutError::Timeout) => {
                let busy = writer.look()?;
                wait = if busy { Duration::ZERO } else { LOOK };
            }
        }
    }
}

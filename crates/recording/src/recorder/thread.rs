//! Writes a running experiment to a file, on a thread of its own.
//!
//! The run waits for it in virtual time only, where waiting costs nothing. Under the real
//! clock, messages that come too fast are lost and counted.

use std::{
    cell::Cell,
    io,
    path::{Path, PathBuf},
    sync::{
        Arc,
        atomic::{AtomicU64, AtomicUsize, Ordering},
    },
    thread::{self, JoinHandle},
    time::Duration,
};

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, bounded};
use ratelab_metrics::{Observer, RunRow, Tap};
use ratelab_re_execution::RunLog;

use super::{Destination, FinishedRecording, RecordError, RunWriter, Source, StopReason, outside};

/// Rows that may wait to be written: minutes at 50 Hz, and more than any real clock produces
/// within the 50 ms between two looks.
pub const BACKLOG: usize = 1 << 16;

/// Interval between two checks of the taps (wall time).
const LOOK: Duration = Duration::from_millis(50);

/// Number of recordings that are not complete.
static OPEN: AtomicUsize = AtomicUsize::new(0);

/// A recording that is not complete, until it is dropped.
struct OpenRecording;

impl OpenRecording {
    fn new() -> Self {
        OPEN.fetch_add(1, Ordering::SeqCst);
        Self
    }
}

impl Drop for OpenRecording {
    fn drop(&mut self) {
        OPEN.fetch_sub(1, Ordering::SeqCst);
    }
}

/// A recording in progress.
pub struct Recorder {
    path: PathBuf,
    reason: Sender<StopReason>,
    /// Whether it was asked to end.
    asked: Cell<bool>,
    lost: Arc<AtomicU64>,
    thread: JoinHandle<io::Result<FinishedRecording>>,
}

impl Recorder {
    /// Records a run that has not begun, from its first tick on, to a new file at `destination`.
    ///
    /// # Errors
    /// The system's error for the file.
    pub fn from_the_start(
        destination: &mut Destination,
        source: &Source,
    ) -> Result<Self, RecordError> {
        Self::start(destination, source, Some(source.taps.all(BACKLOG)))
    }

    /// Records a run that may have begun, from a moment soon after the call. Never waits
    /// for the run.
    ///
    /// # Errors
    /// The system's error for the file.
    pub fn midway(destination: &mut Destination, source: &Source) -> Result<Self, RecordError> {
        // On the thread: a topic that waits for a full tap is locked, and the caller may be the
        // one to empty that tap.
        Self::start(destination, source, None)
    }

    fn start(
        destination: &mut Destination,
        source: &Source,
        tap: Option<Tap<RunRow>>,
    ) -> Result<Self, RecordError> {
        let (path, begin) = destination.create(&source.origin)?;
        let (reason, asked) = bounded(1);
        let lost = Arc::<AtomicU64>::default();
        let source = source.clone();
        let watch = RecordingWatch {
            observer: source.observer.clone(),
            lost: lost.clone(),
            notice: source.notice,
            noticed: 0,
        };
        let thread = thread::Builder::new().name("recorder".to_owned());
        let open = OpenRecording::new();
        let spawned = thread.spawn(move || {
            let _open = open;
            let tap = tap.unwrap_or_else(|| source.taps.all(BACKLOG));
            record(begin(source)?, tap, watch, &asked)
        });
        let refused = |why| RecordError {
            path: path.clone(),
            why,
        };
        Ok(Self {
            thread: spawned.map_err(refused)?,
            path,
            reason,
            asked: Cell::new(false),
            lost,
        })
    }

    /// Returns the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the number of messages and ticks lost because the recorder was too slow.
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }

    /// Asks it to end. The first reason counts.
    pub fn end(&self, reason: StopReason) {
        self.asked.set(true);
        let _ = self.reason.try_send(reason);
    }

    /// Returns whether it was asked to end, or has ended by itself.
    pub fn is_ending(&self) -> bool {
        self.asked.get() || self.has_ended()
    }

    /// Returns whether any recording is not complete: the end of the program leaves its file
    /// without an end.
    pub fn any_is_open() -> bool {
        OPEN.load(Ordering::SeqCst) > 0
    }

    /// Returns whether it has ended, by request or after an error.
    pub fn has_ended(&self) -> bool {
        self.thread.is_finished()
    }

    /// Waits for its end, which must have been requested.
    ///
    /// # Errors
    /// [`RecordError`] if it could not be completed.
    pub fn finish(self) -> Result<FinishedRecording, RecordError> {
        drop(self.reason);
        let panicked = |_| Err(io::Error::other("the recorder panicked, which is a defect"));
        let outcome = self.thread.join().unwrap_or_else(panicked);
        let path = self.path;
        outcome.map_err(|why| RecordError { path, why })
    }
}

/// Writes until asked to end.
fn record(
    mut writer: Box<dyn RunWriter>,
    tap: Tap<RunRow>,
    mut watch: RecordingWatch,
    asked: &Receiver<StopReason>,
) -> io::Result<FinishedRecording> {
    let mut wait = LOOK;
    let reason = loop {
        match asked.recv_timeout(wait) {
            Ok(reason) => break reason,
            Err(RecvTimeoutError::Disconnected) => break StopReason::Off,
            Err(RecvTimeoutError::Timeout) => {
                let busy = writer.look(&tap)?;
                wait = if busy { Duration::ZERO } else { LOOK };
                watch.look(&tap);
            }
        }
    };
    watch.look(&tap);
    writer.complete(tap, &reason)
}

/// What is said of a recording in progress.
struct RecordingWatch {
    observer: Observer,
    lost: Arc<AtomicU64>,
    notice: fn(&str),
    /// Number of writes from outside of the graph of which there was a notice.
    noticed: usize,
}

impl RecordingWatch {
    /// Counts the rows that were lost, and gives a notice of what a thread outside of the graph
    /// wrote to, once for each.
    fn look(&mut self, tap: &Tap<RunRow>) {
        self.lost.store(tap.lost(), Ordering::Relaxed);
        let names = RunLog::attach(&self.observer).written_from_outside();
        for name in names.iter().skip(self.noticed) {
            (self.notice)(&outside(name));
        }
        self.noticed = names.len();
    }
}

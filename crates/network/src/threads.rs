//! Threads.

use std::{
    thread::{self, JoinHandle},
    time::Duration,
};

use crossbeam_channel::{RecvTimeoutError, Sender, bounded};

use crate::error::{Attempted, NetworkError};

/// Begins a thread.
pub(crate) fn thread<T: Send + 'static>(
    name: impl Into<String>,
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<JoinHandle<T>, NetworkError> {
    let begun = thread::Builder::new().name(name.into()).spawn(work);
    begun.tried("cannot start a thread")
}

/// Work that is done again and again, and once more when this is dropped.
pub(crate) struct Beat(Option<(Sender<()>, JoinHandle<()>)>);

impl Beat {
    /// Does `work` at once, and again after each `pause`.
    pub(crate) fn begin(
        name: &str,
        pause: Duration,
        mut work: impl FnMut() + Send + 'static,
    ) -> Result<Self, NetworkError> {
        let (end, ended) = bounded(0);
        let thread = thread(name, move || {
            work();
            while ended.recv_timeout(pause) == Err(RecvTimeoutError::Timeout) {
                work();
            }
            work();
        })?;
        Ok(Self(Some((end, thread))))
    }
}

impl Drop for Beat {
    fn drop(&mut self) {
        if let Some((end, thread)) = self.0.take() {
            drop(end);
            let _ = thread.join();
        }
    }
}

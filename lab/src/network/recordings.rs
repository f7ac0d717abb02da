//! What a dashboard keeps of the runs of other processes: a recording of each, and the
//! summary of the last.

use std::path::Path;

use ratelab::experiment::Summary;

use crate::{
    error::Error,
    output::record_error,
    recording::{Destination, RecordError, Recorded, Recorder, Source, StopReason},
};

/// The recordings so far.
#[derive(Default)]
pub struct Recordings {
    /// Where they go; `None` where nothing is recorded.
    destination: Option<Destination>,
    present: Option<Recorder>,
    done: Vec<Recorder>,
    /// The first file that could not be made.
    refused: Option<Error>,
    /// The summary of the last run, and whether that run ended.
    pub last: Option<(Summary, bool)>,
}

impl Recordings {
    /// No recordings yet; those of later runs go to `destination`, if there is one.
    pub fn new(destination: Option<Destination>) -> Self {
        Self {
            destination,
            ..Self::default()
        }
    }

    /// Records the run of `source` from now on, if runs are recorded.
    pub fn begin(&mut self, mut source: Source) {
        let Some(destination) = &mut self.destination else {
            return;
        };
        source.viewer.clone_from(&destination.viewer);
        let begin = |path: &Path| Recorder::from_the_start(path, &source);
        match destination.claim(&source.origin, begin) {
            Ok((_, recorder)) => self.present = Some(recorder),
            Err((path, why)) => {
                self.refused = Some(record_error(&path, &why));
                self.destination = None;
            }
        }
    }

    /// Ends the present recording, if there is one.
    pub fn end(&mut self, reason: StopReason) {
        if let Some(recorder) = self.present.take() {
            recorder.end(reason);
            self.done.push(recorder);
        }
    }

    /// Whether nothing is recorded, though it should be.
    pub fn is_waiting(&self) -> bool {
        self.present.is_none() && self.destination.is_some()
    }

    /// Waits for all recordings that have ended.
    ///
    /// # Errors
    /// [`Error`] for a file that could not be made.
    pub fn finish(&mut self) -> Result<Vec<Result<Recorded, RecordError>>, Error> {
        let done = std::mem::take(&mut self.done).into_iter();
        let done = done.map(Recorder::finish).collect();
        self.refused.take().map_or(Ok(done), Err)
    }
}

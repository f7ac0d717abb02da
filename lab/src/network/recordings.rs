//! What a dashboard keeps of the runs of other processes: a recording of each, and the
//! summary of the last.

use std::path::PathBuf;

use ratelab_experiment::Summary;

use crate::{error::Error, output::record_error};
use ratelab_recording::{
    Destination, FinishedRecording, RecordError, Recorder, Source, StopReason,
};

/// The recordings so far.
#[derive(Default)]
pub struct Recordings {
    destination: Destination,
    /// Whether runs are recorded.
    on: bool,
    present: Option<Recorder>,
    done: Vec<Recorder>,
    /// The first file that could not be made.
    refused: Option<Error>,
    /// The summary of the last run, and whether that run ended.
    pub last: Option<(Summary, bool)>,
}

impl Recordings {
    /// Creates an empty list; later runs are recorded to `destination`, unless that is `None`.
    pub fn new(destination: Option<Destination>) -> Self {
        Self {
            on: destination.is_some(),
            destination: destination.unwrap_or_default(),
            ..Self::default()
        }
    }

    /// Records the run of `source` from now on.
    ///
    /// # Errors
    /// [`Error`] if the file cannot be made.
    pub fn begin(&mut self, source: Source) -> Result<PathBuf, Error> {
        let begun = Recorder::from_the_start(&mut self.destination, &source);
        self.on = begun.is_ok();
        let recorder = self.present.insert(begun.map_err(record_error)?);
        Ok(recorder.path().to_owned())
    }

    /// Records a run that just began; an error waits for the end.
    pub fn begin_of_run(&mut self, source: Source) {
        if let Err(why) = self.begin(source) {
            self.refused.get_or_insert(why);
        }
    }

    /// Ends the present recording; later runs are recorded as before.
    pub fn end(&mut self, reason: StopReason) {
        if let Some(recorder) = self.present.take() {
            recorder.end(reason);
            self.done.push(recorder);
        }
    }

    /// Begins a recording of `source`, or ends the present one; returns a notice.
    pub fn toggle(&mut self, source: Source) -> String {
        if self.present.is_some() {
            self.end(StopReason::Off);
            self.on = false;
            return "the recording ends".to_owned();
        }
        match self.begin(source) {
            Ok(path) => format!("recording to {}", path.display()),
            Err(why) => why.to_string(),
        }
    }

    /// Whether a run should be recorded that is not.
    pub fn is_waiting(&self) -> bool {
        self.present.is_none() && self.on
    }

    /// Number of messages and ticks that the present recording lost; `None` without one.
    pub fn lost(&self) -> Option<u64> {
        self.present.as_ref().map(Recorder::lost)
    }

    /// Waits for all recordings that have ended.
    ///
    /// # Errors
    /// [`Error`] for a file that could not be made.
    pub fn finish(&mut self) -> Result<Vec<Result<FinishedRecording, RecordError>>, Error> {
        let done = std::mem::take(&mut self.done).into_iter();
        let done = done.map(Recorder::finish).collect();
        self.refused.take().map_or(Ok(done), Err)
    }
}

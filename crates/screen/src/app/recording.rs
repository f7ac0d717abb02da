//! Recordings of sessions, on and off.

use ratelab_recording::{
    Destination, FinishedRecording, RecordError, Recorder, StopReason, outside,
};

use super::{App, run::ShownRun};
use crate::{error::ScreenError, session::Prepared};

/// The recordings of all sessions.
#[derive(Default)]
pub struct LabRecordings {
    /// The destination of the next one.
    pub destination: Destination,
    /// Whether the user wants sessions recorded.
    pub wanted: bool,
    /// Recorders that are being completed.
    completing: Vec<Recorder>,
    /// Complete ones.
    pub recorded: Vec<FinishedRecording>,
    /// The first that ended early.
    pub unrecorded: Option<RecordError>,
}

impl LabRecordings {
    /// Creates recordings to `destination`; without one they are not wanted.
    pub fn to(destination: Option<Destination>) -> Self {
        Self {
            wanted: destination.is_some(),
            destination: destination.unwrap_or_default(),
            ..Self::default()
        }
    }

    /// Begins the recording of a `prepared` session, if it is wanted.
    ///
    /// # Errors
    /// [`ScreenError::Record`] with the system's error for the file.
    pub fn begin(&mut self, prepared: &Prepared) -> Result<Option<Recorder>, ScreenError> {
        let recorder = self.wanted.then(|| prepared.record(&mut self.destination));
        recorder.transpose()
    }
}

impl App {
    /// Starts a recording, or ends it.
    pub(super) fn record(&mut self) {
        if let ShownRun::Remote(run) = &mut self.shown.run {
            let notice = run.record();
            return self.notify(notice);
        }
        if self.ended() {
            self.recordings.wanted = !self.recordings.wanted;
            return self.notify(if self.recordings.wanted {
                "the run is over: r starts one that is recorded"
            } else {
                "the run is over, and the next is not recorded"
            });
        }
        if self.end_recording() {
            return self.follow_recordings();
        }
        let ShownRun::Live(session) = &mut self.shown.run else {
            return;
        };
        match session.record(&mut self.recordings.destination) {
            Ok(path) => {
                self.recordings.wanted = true;
                self.notify(format!("recording to {}", path.display()));
            }
            Err(error) => self.notify(error.to_string()),
        }
    }

    /// Ends the recording of the session; returns whether there is one.
    pub(super) fn end_recording(&mut self) -> bool {
        let recorder = self.session().and_then(|session| session.recorder.as_ref());
        let recorded = recorder
            .map(|recorder| recorder.end(StopReason::Off))
            .is_some();
        self.recordings.wanted &= !recorded;
        recorded
    }

    /// Checks for ended recordings; the end takes a moment.
    pub(super) fn follow_recordings(&mut self) {
        self.complete(|recorder| recorder.has_ended());
    }

    /// Waits for all recordings of past sessions.
    pub(super) fn finish_recordings(&mut self) {
        self.complete(|_| true);
    }

    /// Notes the results of the recordings that are to be `done`, and waits for them.
    fn complete(&mut self, done: fn(&Recorder) -> bool) {
        if let ShownRun::Live(session) = &mut self.shown.run {
            let ending = session.recorder.take_if(|recorder| recorder.is_ending());
            self.recordings.completing.extend(ending);
        }
        let completing = &mut self.recordings.completing;
        let done = completing.extract_if(.., |recorder| done(recorder));
        for recorder in done.collect::<Vec<_>>() {
            self.note_recorded(recorder);
        }
    }

    /// Stores the result of an ending recording.
    fn note_recorded(&mut self, recorder: Recorder) {
        match recorder.finish() {
            Ok(recorded) => {
                let defect = recorded.defect().map(|defect| format!(": {defect}"));
                let path = recorded.path.display();
                self.notify(format!("recorded {path}{}", defect.unwrap_or_default()));
                self.recordings.recorded.push(recorded);
            }
            Err(error) => {
                self.notify(error.to_string());
                self.is_unrecorded(error);
            }
        }
    }

    /// Goes on without a recording; the exit code reports it as well.
    fn is_unrecorded(&mut self, error: RecordError) {
        self.recordings.wanted = false;
        self.recordings.unrecorded.get_or_insert(error);
    }

    /// Goes on without a recording that cannot begin.
    pub(super) fn unrecordable(&mut self, error: ScreenError) {
        self.notify(error.to_string());
        if let ScreenError::Record(error) = error {
            self.is_unrecorded(error);
        }
    }

    /// Gives notice of what a thread outside of the graph wrote to, once for each.
    pub(super) fn notice_outside(&mut self) {
        let ShownRun::Live(session) = &mut self.shown.run else {
            return;
        };
        let names = session.written_from_outside();
        if !names.is_empty() {
            self.notify(outside(&names.join(" and ")));
        }
    }
}

//! Recording the session, on and off.

use super::App;
use crate::{
    dashboard::session::RecordingEnd,
    recording::{Ending, Recorder},
};

impl App {
    /// Begins to record, or ends it.
    pub(super) fn toggle_recording(&mut self) {
        if let Some(recorder) = self.session.recorder() {
            recorder.end(Ending::Off);
            self.record = false;
        } else if self.ended() {
            self.say("the run is over: r starts another, which w then records");
        } else {
            let path = self.destination.next(&self.config);
            match self.session.record(&path) {
                Ok(()) => {
                    self.record = true;
                    self.say(format!("recording to {}", path.display()));
                }
                Err(why) => self.say(format!("cannot record to {}: {why}", path.display())),
            }
        }
    }

    /// Sees whether the recording has ended.
    pub(super) fn follow_recording(&mut self) {
        if let Some(end) = self.session.recorded() {
            self.note_recorded(end);
        }
    }

    /// Waits for the recording of a session that is over.
    pub(super) fn finish_recording(&mut self) {
        if let Some(end) = self.session.finish_recording() {
            self.note_recorded(end);
        }
    }

    fn note_recorded(&mut self, end: RecordingEnd) {
        match end {
            Ok(recorded) => {
                self.say(format!("recorded {}", recorded.path.display()));
                self.recorded.push(recorded);
            }
            Err(error) => {
                self.say(error.to_string());
                self.record = false;
                self.unrecorded.get_or_insert(error);
            }
        }
    }

    /// Whether a recording is made, and what of it was lost.
    pub(super) fn recording(&self) -> Option<u64> {
        self.session.recorder().map(Recorder::lost)
    }

    /// The file to record the next session to, if that is wanted.
    pub(super) fn next_recording(&mut self) -> Option<std::path::PathBuf> {
        self.record.then(|| self.destination.next(&self.config))
    }
}

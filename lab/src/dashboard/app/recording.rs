//! Recordings of sessions, on and off.

use super::App;
use crate::recording::{Recorder, StopReason, outside};

impl App {
    /// Starts a recording, or ends it.
    pub(super) fn toggle_recording(&mut self) {
        if self.ended() {
            self.record = !self.record;
            self.desk.notify(if self.record {
                "the run is over: r starts one that is recorded"
            } else {
                "the run is over, and the next is not recorded"
            });
        } else if let Some(recorder) = self.desk.run.recorder() {
            recorder.end(StopReason::Off);
            self.record = false;
            self.follow_recordings();
        } else {
            match self.desk.run.record(&mut self.destination) {
                Ok(path) => {
                    self.record = true;
                    self.desk.notify(format!("recording to {}", path.display()));
                }
                Err(error) => self.desk.notify(error.to_string()),
            }
        }
    }

    /// Checks for ended recordings; the end takes a moment.
    pub(super) fn follow_recordings(&mut self) {
        self.completing.extend(self.desk.run.take_recorder());
        let done = self
            .completing
            .extract_if(.., |recorder| recorder.has_ended());
        for recorder in done.collect::<Vec<_>>() {
            self.note_recorded(recorder);
        }
    }

    /// Waits for all recordings of past sessions.
    pub(super) fn finish_recordings(&mut self) {
        self.completing.extend(self.desk.run.take_recorder());
        for recorder in std::mem::take(&mut self.completing) {
            self.note_recorded(recorder);
        }
    }

    /// Stores the result of an ending recording.
    fn note_recorded(&mut self, recorder: Recorder) {
        match recorder.finish() {
            Ok(recorded) => {
                let defect = recorded.defect().map(|defect| format!(": {defect}"));
                let path = recorded.path.display();
                self.desk
                    .notify(format!("recorded {path}{}", defect.unwrap_or_default()));
                self.recorded.push(recorded);
            }
            Err(error) => {
                self.desk.notify(error.to_string());
                self.record = false;
                self.unrecorded.get_or_insert(error);
            }
        }
    }

    /// Gives notice of what a thread outside of the graph wrote to, once for each.
    pub(super) fn notice_outside(&mut self) {
        let names = self.desk.run.written_from_outside();
        if !names.is_empty() {
            self.desk.notify(outside(&names.join(" and ")));
        }
    }

    /// Number of items lost by the current recording; `None` without one.
    pub(super) fn recording(&self) -> Option<u64> {
        self.desk.run.recorder().map(Recorder::lost)
    }
}

//! The run of a recording, executed again while its rows are shown.

use super::{Player, Playhead};
use crate::{
    dashboard::{executing::Executing, sampler::Sampler},
    recording::{Executed, Recording, Replay, VerifyError},
};

impl Player {
    /// Begins to execute the run again, if that is possible: its rows are shown until then.
    pub fn execute_again(&mut self) {
        let replay = &self.desk.run.replay;
        if !replay.recording().is_whole() {
            return;
        }
        match Executing::of(replay.shared_recording(), &self.setup.system) {
            Ok(executing) => self.executing = Some(executing),
            Err(error) => self.desk.notify(from_rows(&error)),
        }
    }

    /// Shows the run that was executed again, once it is there; returns whether it is.
    pub(super) fn follow_execution(&mut self) -> bool {
        let over = |executing: &mut Executing| executing.is_over();
        let Some(executing) = self.executing.take_if(over) else {
            return false;
        };
        match executing.finish() {
            Ok(executed) => self.play_executed(executed),
            Err(error) => self.desk.notify(from_rows(&error)),
        }
        true
    }

    fn play_executed(&mut self, Executed { recording, knots }: Executed) {
        let Playhead { at, playing, .. } = self.desk.run;
        let more = ticks(&recording) > ticks(self.desk.run.replay.recording());
        let replay = Replay::new(recording, &self.setup.system);
        self.begins = replay.begins();
        self.desk.run = Playhead::new(replay, playing);
        self.desk.sampler = Sampler::default();
        self.knots = knots;
        self.go(at);
        if more {
            self.desk
                .notify("executed again: this is the whole run, from its start");
        }
    }
}

/// The number of ticks in a recording.
fn ticks(recording: &Recording) -> usize {
    recording.ticks.iter().map(Vec::len).sum()
}

/// The notice that a recording is shown as it is.
fn from_rows(why: &VerifyError) -> String {
    format!("shown from its rows: {}; verify prints more", why.brief())
}

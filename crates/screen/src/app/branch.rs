//! Branches: the run is left at the visible moment, with a knob turned.

use std::sync::Arc;

use ratelab::Time;
use ratelab_recording::{Change, Departure, Recording, branch};

use super::{
    App,
    restart::{LeftRun, Next, Start},
    run::ShownRun,
};
use crate::{frame::FrameData, key_error::KeyError, session::Prepared};

impl App {
    /// Opens the prompt for the knob of a branch at the visible moment; in a branch, for
    /// another branch of the same run.
    pub(super) fn ask_for_branch(&mut self) {
        if let Some((playback, _)) = self.playback() {
            playback.rest();
        }
        let left = self.left.as_ref().filter(|_| self.is_live());
        if let Some(now) = self.shown.now() {
            let at = left.map_or(now, |left| left.change.at.min(now));
            self.prompt.open(Some(at));
        }
    }

    /// Returns the run so far, to be executed again; of a branch, the run that it left.
    fn run_to_leave(&self) -> Option<Arc<Recording>> {
        match (&self.shown.run, &self.left) {
            (ShownRun::Recorded(playback), _) => Some(playback.recording()),
            (_, Some(left)) => Some(left.recording.clone()),
            _ => self.so_far(),
        }
    }

    /// Ends this run and starts a branch of it at run time `at`, with the knobs in `text`:
    /// at the speed and until the end of the session, or for some seconds if it is left there.
    pub(super) fn branch(&mut self, at: Time, text: &str) -> Result<(), KeyError> {
        let recording = self.run_to_leave().ok_or(KeyError::RunGone)?;
        let system = &self.setup.system;
        let departure = Departure {
            at,
            knobs: self.parsed(text)?,
            end: Some(self.config.end).filter(|end| *end > at),
            speed: self.config.speed,
        };
        let branch = branch(&recording, system, &departure).map_err(KeyError::refused)?;
        let left = LeftRun {
            change: Change::new(&recording, &**system, branch.at, text.to_owned()),
            asked: at,
            recording,
        };
        let prepared = Prepared::for_branch(branch, &self.setup);
        let start = Start {
            prepared: prepared.map_err(KeyError::refused)?,
            by_hand: false,
            left: Some(left),
        };
        self.leave_past();
        self.end_with(Next::Session(Box::new(start)));
        Ok(())
    }

    /// Adds what the branch changed to `frame`, if the session is one.
    pub(super) fn follow_branch(&self, frame: &mut FrameData) {
        let verdict = self
            .shown
            .run
            .summary()
            .map(|summary| summary.verdict.clone());
        let sentence = self.left.as_ref().map(|left| left.change.sentence(verdict));
        frame.verdict.why.splice(0..0, sentence);
    }
}

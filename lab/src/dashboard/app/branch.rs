//! Branches: the run is left at the visible moment, with a knob turned.

use std::sync::Arc;

use ratelab::Time;

use super::{App, restart::Next};
use crate::dashboard::{
    branch::{self, PreparedBranch},
    frame::FrameData,
    sampler::RunSource,
};

impl App {
    /// Opens the prompt for the knob of a branch at the visible moment; in a branch, for
    /// another branch of the same run.
    pub(super) fn ask_for_branch(&mut self) {
        let Some(now) = self.desk.frame.as_ref().map(|frame| frame.now) else {
            return;
        };
        let left = self.left.as_ref().map(|left| left.change.at);
        let at = left.map_or(now, |left| left.min(now));
        self.desk.prompt.open(Some(at));
    }

    /// Ends this session and starts a branch of it at run time `at`, with the knobs in
    /// `text`.
    pub(super) fn branch(&mut self, at: Time, text: &str) -> Result<(), String> {
        let recording = match &self.left {
            Some(left) => Some(left.recording.clone()),
            None => self.desk.run.so_far().map(Arc::new),
        };
        let recording = recording.ok_or("this run is gone: r starts again")?;
        let pace = (self.config.end, self.config.speed);
        let branch = branch::prepare(&recording, &self.setup, (at, text), pace)?;
        self.go_to(branch);
        Ok(())
    }

    /// Ends this session and starts a branch.
    pub(super) fn go_to(&mut self, (prepared, left): PreparedBranch) {
        self.desk.run.stop();
        self.next = Some(Next::Session {
            prepared: Box::new(prepared),
            by_hand: false,
            left: Some(left),
        });
    }

    /// Adds what the branch changed to `frame`, if the session is one.
    pub(super) fn follow_branch(&self, frame: &mut FrameData) {
        let verdict = self.desk.run.summary().map(|summary| summary.verdict);
        let sentence = self.left.as_ref().map(|left| left.change.sentence(verdict));
        frame.verdict.why.splice(0..0, sentence);
    }
}

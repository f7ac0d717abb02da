//! The exercises over a running session.

use crossterm::event::KeyEvent;
use ratelab::Speed;
use ratelab_study::{experiment::Config, system::Verdict};

use super::App;
use crate::{
    dashboard::{
        exercise_panel::{ExercisePanel, PanelAction},
        frame::{FrameData, Standing},
        sampler::{RunSource, WatchedRows},
    },
    error::LabError,
    recording::StopReason,
    rescue::RescueStage,
};

/// The place of a cause that an exercise asks for.
const COVERED: &str = "the cause is covered until you have answered: e";

/// Speed of a rescue by hand: slow enough to think.
const BY_HAND: f64 = 0.2;

impl App {
    /// Opens the list, or judges the current rescue. A rescue that can still succeed goes
    /// on, unless this is asked for at once again: then `insist` is true.
    pub(super) fn open_exercises(&mut self, insist: bool) {
        if !self.setup.course {
            return self.desk.notify("there are no exercises for this system");
        }
        let over = self.ended() || self.stage().is_none_or(RescueStage::is_over);
        if !over && !insist {
            self.early = true;
            return self
                .desk
                .notify("not yet, the try goes on: e again gives it up");
        }
        self.panel = Some(match self.judged() {
            Some(panel) => panel,
            None => ExercisePanel::new(self.learner),
        });
    }

    /// How far the rescue by hand has come.
    fn stage(&self) -> Option<RescueStage> {
        let rescue = self.by_hand.as_ref()?;
        let summary = self.desk.run.summary();
        let lost = summary.map(|summary| summary.verdict);
        Some(rescue.stage(&self.events, lost.filter(Verdict::is_lost)))
    }

    /// Adds the control steps in `rows` to the rescue by hand, and its next step to
    /// `frame`.
    pub(super) fn follow_rescue(&mut self, rows: &[WatchedRows], frame: &mut FrameData) {
        let Some(rescue) = &mut self.by_hand else {
            return;
        };
        let states = self.desk.run.system().state();
        let steps = rows.iter().filter(|(topic, _)| Some(*topic) == states);
        steps.for_each(|(_, rows)| rescue.add(rows));
        let advice = self.stage().map(RescueStage::advice);
        frame.verdict.why.splice(0..0, advice);
    }

    /// Covers the cause in `frame` while an exercise asks for it.
    pub(super) fn cover_cause(&self, frame: &mut FrameData) {
        let verdict = &mut frame.verdict;
        if self.covered && matches!(verdict.standing, Standing::Warned | Standing::Lost) {
            verdict.why = vec![COVERED.to_owned()];
        }
    }

    /// The verdict on the recorded rescue; `None` if there is none.
    fn judged(&mut self) -> Option<ExercisePanel> {
        self.by_hand.take()?;
        if let Some(recorder) = self.desk.run.recorder() {
            recorder.end(StopReason::Off);
            self.record = false;
        }
        self.finish_recordings();
        self.desk.notice = None;
        let recorded = self.recorded.last()?;
        Some(ExercisePanel::judging(&recorded.path, self.learner))
    }

    /// Sends a key to the exercises.
    pub(super) fn panel_key(&mut self, key: &KeyEvent) -> Result<(), LabError> {
        let action = self.panel.as_mut().map(|panel| panel.key(key));
        action.map_or(Ok(()), |action| self.follow_panel(action))
    }

    /// Does what the exercises ask for.
    pub(in crate::dashboard) fn follow_panel(
        &mut self,
        action: PanelAction,
    ) -> Result<(), LabError> {
        match action {
            PanelAction::Stay => Ok(()),
            PanelAction::Answered => {
                self.covered = false;
                Ok(())
            }
            PanelAction::Leave => {
                self.panel = None;
                Ok(())
            }
            PanelAction::ByHand => {
                self.panel = None;
                self.covered = false;
                self.try_by_hand()
            }
            PanelAction::Watch(scene) => {
                self.panel = None;
                self.covered = true;
                self.restart(Config {
                    speed: self.config.speed,
                    end: self.config.end,
                    ..*scene
                })?;
                self.desk
                    .notify("whose fault is it? i explains the pane in focus; e, then your answer");
                Ok(())
            }
        }
    }

    /// Starts the usual session in slow motion, with a recording.
    pub(super) fn try_by_hand(&mut self) -> Result<(), LabError> {
        let config = Config {
            speed: Speed::times(BY_HAND).unwrap_or(Speed::REAL_TIME),
            end: self.config.end,
            ..Config::default()
        };
        self.start(config, true)
    }
}

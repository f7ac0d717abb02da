//! The exercises over a running session.

use crossterm::event::KeyEvent;
use ratelab::{experiment::Config, runtime::Speed};

use super::{App, LabError};
use crate::{
    dashboard::exercise_panel::{ExercisePanel, PanelAction},
    recording::StopReason,
};

/// Speed of a rescue by hand: time to think.
const BY_HAND: f64 = 0.2;

impl App {
    /// Opens the list, or judges the rescue that is being tried.
    pub(super) fn open_exercises(&mut self) {
        if !self.setup.course {
            return self.notify("there are no exercises for this system");
        }
        self.panel = Some(match self.judged() {
            Some(panel) => panel,
            None => ExercisePanel::new(),
        });
    }

    /// The verdict on the rescue that was recorded; `None` if there is none.
    fn judged(&mut self) -> Option<ExercisePanel> {
        if !std::mem::take(&mut self.by_hand) {
            return None;
        }
        if let Some(recorder) = self.session.recorder() {
            recorder.end(StopReason::Off);
            self.record = false;
        }
        self.finish_recordings();
        self.notice = None;
        let recorded = self.recorded.last()?;
        Some(ExercisePanel::judging(&recorded.path))
    }

    /// Gives a key to the exercises.
    pub(super) fn panel_key(&mut self, key: &KeyEvent) -> Result<(), LabError> {
        let action = self.panel.as_mut().map(|panel| panel.key(key));
        match action {
            Some(PanelAction::Stay) | None => Ok(()),
            Some(PanelAction::Leave) => {
                self.panel = None;
                Ok(())
            }
            Some(PanelAction::ByHand) => {
                self.panel = None;
                self.try_by_hand()
            }
        }
    }

    /// Starts the usual session in slow motion, recorded.
    fn try_by_hand(&mut self) -> Result<(), LabError> {
        let by_hand = Config {
            speed: Speed::times(BY_HAND).unwrap_or(Speed::REAL_TIME),
            end: self.config.end,
            ..Config::default()
        };
        self.restart_by_hand(by_hand)
    }
}

//! The exercises over a running session.

use crossterm::event::KeyEvent;
use ratelab::{
    experiment::Config,
    runtime::{Knob, Speed, telemetry::Event},
};

use super::{App, LabError};
use crate::{
    dashboard::exercise_panel::{ExercisePanel, PanelAction},
    recording::StopReason,
};

/// Speed of a rescue by hand: slow enough to think.
const BY_HAND: f64 = 0.2;

impl App {
    /// Opens the list, or judges the current rescue.
    pub(super) fn open_exercises(&mut self) {
        if !self.setup.course {
            return self.notify("there are no exercises for this system");
        }
        if self.by_hand && !self.ended() && !self.may_be_rescued() {
            return self
                .notify("not yet: b breaks it, ] brings it back while the pole leans, then e");
        }
        self.panel = Some(match self.judged() {
            Some(panel) => panel,
            None => ExercisePanel::new(self.learner),
        });
    }

    /// Whether the system was broken and then restored, so that the rescue can be judged.
    fn may_be_rescued(&self) -> bool {
        let rates = self.events.iter().filter_map(Event::knob);
        let rates = rates.filter_map(|timed| match timed.knob {
            Knob::Rate { hz, .. } => Some(hz.get()),
            _ => None,
        });
        let rates: Vec<f64> = rates.collect();
        let slowest = rates.iter().copied().fold(f64::INFINITY, f64::min);
        rates.last().is_some_and(|last| *last > slowest)
    }

    /// The verdict on the recorded rescue; `None` if there is none.
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
        Some(ExercisePanel::judging(&recorded.path, self.learner))
    }

    /// Sends a key to the exercises.
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
            Some(PanelAction::Watch(scene)) => {
                self.panel = None;
                self.restart(Config {
                    speed: self.config.speed,
                    end: self.config.end,
                    ..*scene
                })?;
                self.notify("whose fault is it? i explains the pane in focus; e, then your answer");
                Ok(())
            }
        }
    }

    /// Starts the usual session in slow motion, with a recording.
    fn try_by_hand(&mut self) -> Result<(), LabError> {
        let by_hand = Config {
            speed: Speed::times(BY_HAND).unwrap_or(Speed::REAL_TIME),
            end: self.config.end,
            ..Config::default()
        };
        self.restart_by_hand(by_hand)
    }
}

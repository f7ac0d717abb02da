//! The exercises over a running session.

use crossterm::event::KeyEvent;
use ratelab::{experiment::Config, runtime::Speed};

use super::{App, LabError};
use crate::{
    dashboard::desk::{Desk, Wish},
    recording::Ending,
};

/// Speed of a rescue by hand: time to think.
const BY_HAND: f64 = 0.2;

impl App {
    /// Opens the list, or judges the rescue that is being tried.
    pub(super) fn open_exercises(&mut self) {
        self.desk = Some(match self.judged() {
            Some(desk) => desk,
            None => Desk::new(),
        });
    }

    /// The verdict on the rescue that was recorded; `None` if there is none.
    fn judged(&mut self) -> Option<Desk> {
        if !std::mem::take(&mut self.by_hand) {
            return None;
        }
        if let Some(recorder) = self.session.recorder() {
            recorder.end(Ending::Off);
            self.record = false;
        }
        self.finish_recordings();
        self.notice = None;
        let recorded = self.recorded.last()?;
        Some(Desk::judging(&recorded.path))
    }

    /// Gives a key to the exercises.
    pub(super) fn at_desk(&mut self, key: &KeyEvent) -> Result<(), LabError> {
        let wish = self.desk.as_mut().map(|desk| desk.key(key));
        match wish {
            Some(Wish::Stay) | None => Ok(()),
            Some(Wish::Leave) => {
                self.desk = None;
                Ok(())
            }
            Some(Wish::ByHand) => {
                self.desk = None;
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

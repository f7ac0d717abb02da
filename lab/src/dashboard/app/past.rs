//! Looking back at a run of the real clock, tick by tick.

use crossterm::event::KeyEvent;
use ratelab::{ClockKind, Command, Event};

use super::App;
use crate::{
    dashboard::{executing::Executing, model::Model, player::Player, sampler::RunSource},
    error::LabError,
};

/// A run that is looked at again.
pub(super) enum Past {
    /// It is executed again.
    Executing(Executing),
    /// It is played.
    Playing(Box<Player>),
}

impl App {
    /// Whether the run is at rest and was under the real clock, so that it can be executed
    /// again tick by tick.
    fn has_past(&self) -> bool {
        let handed_over = |event: &Event| {
            let command = event.applied();
            matches!(command, Some(Command::HandOver(ClockKind::Real)))
        };
        let real = self.desk.run.config().clock == ClockKind::Real;
        let real = real || self.events.iter().any(handed_over);
        real && self.desk.run.at_rest()
    }

    /// Looks back: at the run itself if it can be executed again, or else at the picture
    /// before.
    pub(super) fn look_back(&mut self) {
        if self.looking_back().is_none() && self.has_past() {
            let Some(recording) = self.desk.run.so_far() else {
                return self.desk.notify("this run is gone: r starts again");
            };
            match Executing::of(recording.into(), &self.setup.system) {
                Ok(executing) => self.past = Some(Past::Executing(executing)),
                Err(error) => self.desk.notify(error.to_string()),
            }
        } else if !self.history.back() {
            self.desk.notify("this is the oldest picture kept");
        }
    }

    /// Follows the execution, and then the player; returns whether there is something new.
    pub(super) fn follow_past(&mut self) -> Result<bool, LabError> {
        match self.past.take() {
            None => Ok(false),
            Some(Past::Executing(executing)) if !executing.is_over() => {
                self.desk.notify(executing.progress());
                self.past = Some(Past::Executing(executing));
                Ok(true)
            }
            Some(Past::Executing(executing)) => {
                match executing.finish() {
                    Ok(executed) => {
                        let pace = (self.config.end, self.config.speed);
                        let player = Player::at_the_end(executed, &self.setup.system);
                        let mut player = player.within(self.setup.clone(), pace, self.desk.panes);
                        player.sample()?;
                        self.past = Some(Past::Playing(Box::new(player)));
                    }
                    Err(error) => self.desk.notify(error.to_string()),
                }
                Ok(true)
            }
            Some(Past::Playing(mut player)) => {
                let new = player.sample();
                self.past = Some(Past::Playing(player));
                new
            }
        }
    }

    /// Sends a key to the player, if the run is played; returns whether it is.
    pub(super) fn is_for_the_past(&mut self, key: &KeyEvent) -> Result<bool, LabError> {
        let Some(Past::Playing(player)) = &mut self.past else {
            return Ok(false);
        };
        player.key(key)?;
        if player.wants_quit() {
            let branch = player.take_branch();
            self.past = None;
            if let Some(branch) = branch {
                self.go_to(branch);
            }
        }
        Ok(true)
    }

    /// The player, if the run is played.
    pub(super) fn player(&self) -> Option<&Player> {
        match &self.past {
            Some(Past::Playing(player)) => Some(player),
            _ => None,
        }
    }
}

//! The model behind the dashboard: the lab, a replay, or a run of other processes.

use crossterm::event::KeyEvent;
use ratelab::Time;

use super::{
    desk::Desk,
    keys::{PaneAction, is_chord},
    prompt::Vocabulary,
    sampler::RunSource,
    view::ScreenState,
};
use crate::error::LabError;

/// The lab, a replay, or a run of other processes, as the loop of the dashboard drives it.
pub trait Model {
    /// What it looks at.
    type Run: RunSource;

    /// How it looks at that.
    fn desk(&self) -> &Desk<Self::Run>;

    /// The same, to be changed.
    fn desk_mut(&mut self) -> &mut Desk<Self::Run>;

    /// Takes a sample; returns whether there is something new to draw.
    ///
    /// # Errors
    /// [`LabError`] if what is looked at failed.
    fn sample(&mut self) -> Result<bool, LabError>;

    /// The screen; `None` before the first sample.
    fn screen(&self) -> Option<ScreenState<'_>>;

    /// Handles a key.
    ///
    /// # Errors
    /// [`LabError`] if it cannot be done and nothing else can.
    fn key(&mut self, key: &KeyEvent) -> Result<(), LabError>;

    /// Turns the knobs in `text`, which was typed.
    ///
    /// # Errors
    /// Why they are refused.
    fn enter(&mut self, text: &str) -> Result<(), String>;

    /// The words that can be typed.
    fn vocabulary(&self) -> Vocabulary<'_> {
        self.desk().vocabulary(&[])
    }

    /// Takes pasted text.
    fn paste(&mut self, text: &str) {
        self.desk_mut().prompt.paste(text);
    }

    /// Rests before the program is stopped.
    fn rest(&mut self) {}

    /// Goes on after the program was stopped.
    fn go_on(&mut self) {}

    /// Whether the person has left.
    fn wants_quit(&self) -> bool {
        self.desk().quit
    }

    /// Sends `key` to the input line or to the page over the panes, unless it is to `quit`;
    /// returns whether one of them was open. Enter turns the typed knobs.
    fn is_typed(&mut self, key: &KeyEvent, quit: bool) -> bool {
        if !self.desk().prompt.is_open() || is_chord(key) {
            return !quit && self.desk_mut().panes.scroll(key);
        }
        let mut prompt = std::mem::take(&mut self.desk_mut().prompt);
        let entered = prompt.key(key, &self.vocabulary());
        self.desk_mut().prompt = prompt;
        if let Some(text) = entered
            && let Err(reason) = self.enter(&text)
        {
            self.desk_mut().prompt.refuse(reason);
        }
        true
    }

    /// Does `action` on the panes, at run time `now`.
    fn act_on_panes(&mut self, action: PaneAction, now: Time) {
        let desk = self.desk();
        let run = (&desk.run, now);
        match desk.panes.after(action, self.screen().as_ref(), run) {
            Ok(panes) => self.desk_mut().panes = panes,
            Err(notice) => self.desk_mut().notify(notice),
        }
    }
}

//! The model behind the dashboard: the lab, or a replay.

use crossterm::event::KeyEvent;

use super::view::ScreenState;
use crate::error::LabError;

/// The lab or a replay, as the loop of the dashboard drives it.
pub trait Model {
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

    /// Takes pasted text.
    fn paste(&mut self, text: &str);

    /// Rests before the program is stopped.
    fn rest(&mut self);

    /// Goes on after the program was stopped.
    fn go_on(&mut self);

    /// Whether the person has left.
    fn wants_quit(&self) -> bool;
}

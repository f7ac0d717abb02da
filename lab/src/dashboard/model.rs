//! What the loop of the dashboard draws and obeys: the lab, or a replay.

use crossterm::event::KeyEvent;

use super::{error::LabError, view::ScreenState};

/// What a dashboard is of, and how keys change it.
pub trait Model {
    /// Looks at it; says whether there is something new to draw.
    ///
    /// # Errors
    /// [`LabError`] if what is looked at failed.
    fn sample(&mut self) -> Result<bool, LabError>;

    /// What is on the screen; `None` before the first sample.
    fn screen(&self) -> Option<ScreenState<'_>>;

    /// Does what a key asks for.
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

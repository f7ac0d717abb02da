//! The session's run, looked at tick by tick.

use super::{executing::Executing, player::Player};

/// A run that is looked at again.
pub enum Past {
    /// It is executed again.
    Executing(Executing),
    /// It is played.
    Playing(Box<Player>),
}

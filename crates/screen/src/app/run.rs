//! A run that is shown: one here, a recording, or one of other processes.

use std::ops::{Deref, DerefMut};

use ratelab::Command;

use crate::{
    playback::Playback,
    run::{Remote, RunSource},
    session::Session,
};

/// A run that is shown.
pub enum ShownRun {
    /// A run here.
    Live(Box<Session>),
    /// A recording that is played.
    Recorded(Box<Playback>),
    /// A run of other processes.
    Remote(Box<dyn Remote>),
}

impl ShownRun {
    /// Asks for `command`; a recording obeys none.
    pub fn send(&mut self, command: Command) {
        match (self, command) {
            (Self::Live(session), command) => session.send(command),
            (Self::Remote(run), Command::Set(knob)) => run.turn(knob),
            _ => {}
        }
    }
}

impl Deref for ShownRun {
    type Target = dyn RunSource;

    fn deref(&self) -> &Self::Target {
        match self {
            Self::Live(session) => &**session,
            Self::Recorded(playback) => &**playback,
            Self::Remote(run) => &**run,
        }
    }
}

impl DerefMut for ShownRun {
    fn deref_mut(&mut self) -> &mut Self::Target {
        match self {
            Self::Live(session) => &mut **session,
            Self::Recorded(playback) => &mut **playback,
            Self::Remote(run) => &mut **run,
        }
    }
}

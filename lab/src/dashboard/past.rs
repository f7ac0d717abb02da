//! The session's run, executed again to be looked at tick by tick.

use std::{
    sync::Arc,
    thread::{self, JoinHandle},
};

use ratelab::runtime::{Observer, Time};

use super::{player::Player, sampler::RunSource, session::Session};
use crate::recording::{Execution, Recording, VerifyError};

/// A run that is looked at again.
pub enum Past {
    /// It is executed again.
    Executing(Executing),
    /// It is played.
    Playing(Box<Player>),
}

/// A run that is executed again.
pub struct Executing {
    thread: JoinHandle<Result<Recording, VerifyError>>,
    observer: Observer,
    until: Time,
}

impl Executing {
    /// Begins to execute the run of `session` so far again.
    ///
    /// # Errors
    /// Why this is impossible.
    pub fn of(session: &Session) -> Result<Self, String> {
        let recording = session.so_far().ok_or("this run is gone: r starts again")?;
        let until = recording.until;
        let execution = Execution::new(recording, session.shared_system());
        let execution = execution.map_err(|error| error.to_string())?;
        Ok(Self {
            observer: execution.observer(),
            thread: thread::spawn(move || execution.run()),
            until,
        })
    }

    /// How far it is.
    pub fn progress(&self) -> String {
        let now = self.observer.now();
        format!("executing the run again: {now} of {}", self.until)
    }

    /// Whether it is over.
    pub fn is_over(&self) -> bool {
        self.thread.is_finished()
    }

    /// The run, and the moment at which it was left.
    ///
    /// # Errors
    /// Why it is not there.
    pub fn finish(self) -> Result<(Arc<Recording>, Time), String> {
        let executed = self.thread.join();
        let executed = executed.map_err(|_| "the execution panicked, which is a defect")?;
        let recording = executed.map_err(|error| error.to_string())?;
        Ok((Arc::new(recording), self.until))
    }
}

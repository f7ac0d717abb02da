//! A run, executed again on a thread of its own.

use std::{
    panic::resume_unwind,
    sync::Arc,
    thread::{self, JoinHandle},
};

use ratelab::Time;
use ratelab_account::Observer;
use ratelab_study::system::System;

use crate::recording::{Executed, Execution, Recording, VerifyError};

/// A run that is executed again.
pub struct Executing {
    thread: JoinHandle<Result<Executed, VerifyError>>,
    observer: Observer,
    until: Time,
}

impl Executing {
    /// Begins to execute the run of `recording` again.
    ///
    /// # Errors
    /// [`VerifyError`] if it cannot be executed again.
    pub fn of(recording: Arc<Recording>, system: &Arc<dyn System>) -> Result<Self, VerifyError> {
        let execution = Execution::new(recording.clone(), system)?;
        let (observer, until) = (execution.observer(), recording.until);
        Ok(Self {
            thread: thread::spawn(move || execution.run()),
            observer,
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

    /// The run.
    ///
    /// # Errors
    /// [`VerifyError`] if it is another run.
    pub fn finish(self) -> Result<Executed, VerifyError> {
        self.thread
            .join()
            .unwrap_or_else(|panic| resume_unwind(panic))
    }
}

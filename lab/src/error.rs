//! Errors of the commands.

use std::{
    io::{self, ErrorKind},
    path::Path,
    process::ExitCode,
};

use exercises::framework::{AnswersError, Failure};
use ratelab::{Fault, Time};
use ratelab_experiment::{hunt::HuntError, sweep::SweepError};
use ratelab_system::BuildError;
use thiserror::Error;

use ratelab_recording::{ReadError, RecordError, Recording, VerifyError};
use ratelab_screen::ScreenError;

/// An error of a command.
#[derive(Debug, Error)]
pub enum Error {
    /// Invalid input.
    #[error("{0}")]
    BadInput(String),
    /// A node failed.
    #[error("{0}")]
    Fault(#[from] Fault),
    /// Building the graph failed.
    #[error("{0}")]
    Build(#[from] BuildError),
    /// A sweep was invalid, or one of its runs failed.
    #[error("{0}")]
    Sweep(#[from] SweepError),
    /// A hunt that cannot be, or one of its runs failed.
    #[error("{0}")]
    Hunt(#[from] HuntError),
    /// What was asked for is not done, or not to the end.
    #[error("{0}")]
    Unfinished(String),
    /// A recording ended early; the run continued.
    #[error("{0}")]
    Record(#[from] RecordError),
    /// A recording is unreadable.
    #[error("{0}")]
    Read(#[from] ReadError),
    /// A recording differs from a repetition of its run.
    #[error("{file}: {why}")]
    Unverified {
        /// Path of the file.
        file: String,
        /// The difference.
        why: VerifyError,
    },
    /// An exercise that could not be measured.
    #[error("{0}")]
    Exercise(#[from] Failure),
    /// The file of predictions is unusable.
    #[error("{0}")]
    Answers(#[from] AnswersError),
    /// The connection to other processes failed.
    #[cfg(feature = "network")]
    #[error("{0}")]
    Network(String),
    /// The dashboard ended with an error.
    #[error("{0}")]
    Screen(#[from] ScreenError),
    /// Writing a result failed.
    #[error("cannot write {what}: {why}")]
    Write {
        /// Name of the file.
        what: String,
        /// The error of the operating system.
        why: io::Error,
    },
}

impl Error {
    /// Creates the error for a recording called `file` that differs from its repetition.
    pub fn unverified(file: impl ToString, why: VerifyError) -> Self {
        Self::Unverified {
            file: file.to_string(),
            why,
        }
    }

    /// Returns an error if `--at` is a moment after the end of `recording`.
    pub fn if_after_end(at: Time, recording: &Recording) -> Result<(), Self> {
        let end = recording.until;
        if at <= end {
            return Ok(());
        }
        Err(Self::BadInput(format!(
            "--at {at}: this recording ends at {end}: choose an earlier moment"
        )))
    }

    /// Creates the error for a file or folder that cannot be created: bad input, with the `option`.
    pub fn unwritable(option: &str, path: &Path, why: &io::Error) -> Self {
        let what = match why.kind() {
            ErrorKind::NotFound => "there is no such folder: make it first".to_owned(),
            ErrorKind::IsADirectory => "this is a folder: name a file in it".to_owned(),
            ErrorKind::AlreadyExists | ErrorKind::NotADirectory => {
                "a file is where a folder is needed: choose another name".to_owned()
            }
            _ => format!("{why}: choose a place that can be written to"),
        };
        Self::BadInput(format!("{option} {}: {what}", path.display()))
    }

    /// Creates an error for a command that this program was built without.
    #[cfg(not(feature = "network"))]
    pub fn without_network(command: &str) -> Self {
        Self::BadInput(format!(
            "{command} needs the network, which this program was built without: \
             cargo install --path lab --features network"
        ))
    }

    /// Returns an error if only `done` of `all` are done, such as `runs`, because somebody asked
    /// for a stop.
    pub fn if_stopped(done: usize, all: usize, what: &str) -> Result<(), Self> {
        if done == all {
            return Ok(());
        }
        Err(Self::Unfinished(format!(
            "stopped after {done} of {all} {what}: the result is of these"
        )))
    }

    /// Returns an error for a damaged recording, of which only the intact part was read.
    pub fn if_damaged(recording: &Recording) -> Result<(), Self> {
        match recording.defect() {
            Some(defect) => {
                let file = recording.path.display();
                Err(Self::Unfinished(format!("{file}: {defect}")))
            }
            None => Ok(()),
        }
    }

    /// Returns whether Ctrl-C ended a verification.
    pub fn is_stop(&self) -> bool {
        match self {
            Self::Unverified { why, .. } => matches!(why, VerifyError::Stopped),
            _ => false,
        }
    }

    /// 2 for bad input, 1 for an unfinished run.
    pub fn exit_code(&self) -> ExitCode {
        let is_setting = |why: &BuildError| matches!(why, BuildError::Setting(_));
        let bad_input = match self {
            Self::BadInput(_) | Self::Read(_) => true,
            Self::Answers(why) => !matches!(why, AnswersError::Unwritten { .. }),
            Self::Build(why)
            | Self::Hunt(HuntError::Build(why))
            | Self::Sweep(SweepError::Build { source: why, .. }) => is_setting(why),
            Self::Unverified { why, .. } => matches!(why, VerifyError::OtherSystem { .. }),
            Self::Hunt(why) => !matches!(why, HuntError::Fault(_)),
            Self::Sweep(why) => !matches!(why, SweepError::Fault { .. }),
            _ => false,
        };
        ExitCode::from(if bad_input { 2 } else { 1 })
    }
}

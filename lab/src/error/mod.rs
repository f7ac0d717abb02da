//! Errors of the commands.

mod lab;

use std::{
    io::{self, ErrorKind},
    path::Path,
    process::ExitCode,
};

use exercises::framework::{AnswersError, Failure};
use ratelab::{Fault, Time};
use ratelab_cart_pole::stability::StabilityError;
use ratelab_study::{
    experiment::{hunt::HuntError, sweep::SweepError},
    system::BuildError,
};
use thiserror::Error;

pub use lab::LabError;

use crate::recording::{ReadError, RecordError, Recording, VerifyError};

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
    /// Ctrl-C ended a sweep.
    #[error("stopped after {done} of {cells} runs: the result is of these")]
    Stopped {
        /// Number of finished runs.
        done: usize,
        /// Number of planned runs.
        cells: usize,
    },
    /// Linear theory failed unexpectedly.
    #[error("{0}")]
    Theory(StabilityError),
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
    /// A damaged recording, of which only the intact part was read.
    #[error("{file}: {defect}")]
    Damaged {
        /// Path of the file.
        file: String,
        /// The defect.
        defect: String,
    },
    /// Some of several recordings differ from repetitions of their runs.
    #[error("{failed} of {of} recordings were not verified")]
    Failed {
        /// Number of different recordings.
        failed: usize,
        /// Number of all recordings.
        of: usize,
    },
    /// A session that does not count as the learner's rescue.
    #[error("{0} is not accepted as your rescue")]
    NotRescued(String),
    /// Hand-ins that are not acceptable.
    #[error("{refused} of {of} hand-ins are not acceptable")]
    NotAccepted {
        /// Number of these hand-ins.
        refused: usize,
        /// Number of all hand-ins.
        of: usize,
    },
    /// Ctrl-C ended the grading.
    #[error("stopped after {graded} of {of} hand-ins: the result is of these")]
    HalfGraded {
        /// Number of graded hand-ins.
        graded: usize,
        /// Number of all hand-ins.
        of: usize,
    },
    /// An exercise that could not be measured.
    #[error("{0}")]
    Exercise(#[from] Failure),
    /// The file of predictions is unusable.
    #[error("{0}")]
    Answers(#[from] AnswersError),
    /// Measurements differ from the promises of the exercises; contains their number.
    #[error("{0} measurements do not hold: the runtime differs from that of the exercises")]
    Broken(usize),
    /// The connection to other processes failed.
    #[cfg(feature = "network")]
    #[error("{0}")]
    Network(String),
    /// The rerun viewer could not be opened.
    #[error("{0}")]
    Viewer(String),
    /// The dashboard ended with an error.
    #[error("{0}")]
    Lab(#[from] LabError),
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
    /// A file that cannot be opened or read: bad input, with the name of the `option`.
    pub fn file(option: &str, path: &Path, why: &io::Error) -> Self {
        Self::BadInput(format!("{option} {}: {why}", path.display()))
    }

    /// An error if `--at` is a moment after the end of `recording`.
    pub fn if_after_end(at: Time, recording: &Recording) -> Result<(), Self> {
        let end = recording.until;
        if at <= end {
            return Ok(());
        }
        Err(Self::BadInput(format!(
            "--at {at}: this recording ends at {end}: choose an earlier moment"
        )))
    }

    /// A file or folder that cannot be created: bad input, with the name of the `option`.
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

    /// An error for a command that this program was built without.
    #[cfg(not(feature = "network"))]
    pub fn without_network(command: &str) -> Self {
        Self::BadInput(format!(
            "{command} needs the network, which this program was built without: \
             cargo install --path lab --features network"
        ))
    }

    /// An error for a damaged recording, of which only the intact part was read.
    pub fn if_damaged(recording: &Recording) -> Result<(), Self> {
        match recording.defect() {
            Some(defect) => {
                let file = recording.path.display().to_string();
                Err(Self::Damaged { file, defect })
            }
            None => Ok(()),
        }
    }

    /// Whether Ctrl-C ended a verification.
    pub fn is_stop(&self) -> bool {
        let why = match self {
            Self::Unverified { why, .. } => Some(why),
            _ => None,
        };
        matches!(why, Some(VerifyError::Stopped))
    }

    /// 2 for bad input, 1 for an unfinished run.
    pub fn exit_code(&self) -> ExitCode {
        match self {
            Self::BadInput(_)
            | Self::Read(_)
            | Self::Answers(_)
            | Self::Build(BuildError::Setting(_))
            | Self::Unverified {
                why: VerifyError::OtherSystem { .. },
                ..
            }
            | Self::Hunt(
                HuntError::NoBudget
                | HuntError::TooMuch
                | HuntError::Endless
                | HuntError::Target { .. }
                | HuntError::LostAnyway(_)
                | HuntError::Build(BuildError::Setting(_)),
            )
            | Self::Sweep(
                SweepError::Setting(_)
                | SweepError::Empty(_)
                | SweepError::TooMany(_)
                | SweepError::Endless
                | SweepError::Build {
                    source: BuildError::Setting(_),
                    ..
                },
            ) => ExitCode::from(2),
            _ => ExitCode::FAILURE,
        }
    }
}

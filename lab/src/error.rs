//! Errors of the command.

use std::{
    io::{self, ErrorKind},
    path::Path,
    process::ExitCode,
};

use exercises::framework::{AnswersError, Failure};
use ratelab::{
    experiment::sweep::SweepError, runtime::Fault, stability::StabilityError, system::BuildError,
};
use thiserror::Error;

use crate::{
    dashboard::error::LabError,
    recording::{ReadError, RecordError, Recording, VerifyError},
};

/// Why the command ends without having done what it was asked.
#[derive(Debug, Error)]
pub enum Error {
    /// It was asked for something it does not accept.
    #[error("{0}")]
    BadInput(String),
    /// A node failed.
    #[error("{0}")]
    Fault(#[from] Fault),
    /// The graph could not be built as asked.
    #[error("{0}")]
    Build(#[from] BuildError),
    /// A sweep could not be run, or one of its runs failed.
    #[error("{0}")]
    Sweep(#[from] SweepError),
    /// Ctrl-C ended a sweep.
    #[error("stopped after {done} of {cells} runs: the result is of these")]
    Stopped {
        /// Runs that were made.
        done: usize,
        /// Runs that were to be made.
        cells: usize,
    },
    /// Linear theory has no answer where it should have one.
    #[error("{0}")]
    Theory(StabilityError),
    /// A recording ended early; the run did not.
    #[error("{0}")]
    Record(#[from] RecordError),
    /// A recording that cannot be read.
    #[error("{0}")]
    Read(#[from] ReadError),
    /// A recording that is not what comes of running it again.
    #[error("{file}: {why}")]
    Unverified {
        /// The file.
        file: String,
        /// What was found.
        why: VerifyError,
    },
    /// Some of several recordings are not what comes of running them again.
    #[error("{failed} of {of} recordings were not verified")]
    Failed {
        /// How many.
        failed: usize,
        /// Of how many.
        of: usize,
    },
    /// A session that is not the learner's rescue.
    #[error("{0} is not accepted as your rescue")]
    NotRescued(String),
    /// An exercise cannot be measured.
    #[error("{0}")]
    Exercise(#[from] Failure),
    /// The file of predictions cannot be used.
    #[error("{0}")]
    Answers(#[from] AnswersError),
    /// An exercise measured something else than it promises.
    #[error("{0} measurements do not hold: the runtime is not what the exercises are about")]
    Broken(usize),
    /// The rerun viewer cannot be opened.
    #[error("{0}")]
    Viewer(String),
    /// The dashboard ended other than by a key.
    #[error("{0}")]
    Lab(#[from] LabError),
    /// Something that was to be written could not be.
    #[error("cannot write {what}: {why}")]
    Write {
        /// The file.
        what: String,
        /// What the system said.
        why: io::Error,
    },
}

impl Error {
    /// A file that cannot be opened or read, as bad input naming `option`.
    pub fn file(option: &str, path: &Path, why: &io::Error) -> Self {
        Self::BadInput(format!("{option} {}: {why}", path.display()))
    }

    /// A file or folder that cannot be made, as bad input naming `option`.
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

    /// The error of a file that was read as far as it is intact; none for a whole
    /// one.
    pub fn if_damaged(recording: &Recording) -> Result<(), Self> {
        match recording.defect() {
            Some(defect) => {
                let file = recording.path.display();
                Err(Self::BadInput(format!("{file}: {defect}")))
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

    /// 2 for bad input, 1 for a run that could not finish.
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

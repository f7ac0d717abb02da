//! Errors of loading a policy.

use std::io;

use ratelab_study::file::FileError;
use thiserror::Error;

use super::{Digest, LARGEST_FILE, LqrError, OnnxError, WeightsError};

/// An error while loading a policy.
#[derive(Debug, Error)]
#[error("{spec}: {kind}")]
pub struct PolicyError {
    /// Name or path of the policy.
    pub spec: String,
    /// Kind of the error.
    #[source]
    pub kind: PolicyErrorKind,
}

/// The kinds of [`PolicyError`].
#[derive(Debug, Error)]
pub enum PolicyErrorKind {
    /// Neither a built-in policy nor a file has this name.
    #[error(
        "expected scripted, zero, random, lqr or a file of weights; found neither a policy nor a \
         file of that name"
    )]
    Missing,
    /// A directory, pipe or device instead of a file.
    #[error("expected a file of weights, found {0}")]
    NoFile(&'static str),
    /// An error of the operating system.
    #[error("expected a file of weights, found one that cannot be read: {0}")]
    Unreadable(io::Error),
    /// A file above the size limit.
    #[error("expected a file of weights of {LARGEST_FILE} bytes at most, found {0} bytes")]
    TooLarge(u64),
    /// The file's content has changed.
    #[error("expected the content with the SHA-256 {expected}, found another one: {found}")]
    Changed {
        /// The expected content.
        expected: Digest,
        /// The content found.
        found: Digest,
    },
    /// Invalid weights for this robot.
    #[error(transparent)]
    Weights(#[from] WeightsError),
    /// Invalid ONNX graph for this robot, or a missing runtime.
    #[error(transparent)]
    Onnx(#[from] OnnxError),
    /// Computing the regulator failed.
    #[error(transparent)]
    Lqr(#[from] LqrError),
}

impl From<FileError> for PolicyErrorKind {
    fn from(error: FileError) -> Self {
        match error {
            FileError::NoFile(what) => Self::NoFile(what),
            FileError::TooLarge(bytes) => Self::TooLarge(bytes),
            FileError::Unreadable(why) if why.kind() == io::ErrorKind::NotFound => Self::Missing,
            FileError::Unreadable(why) => Self::Unreadable(why),
        }
    }
}

//! Errors of loading a policy.

use std::io;

use thiserror::Error;

use super::{Digest, LARGEST_FILE, LqrError, OnnxError, WeightsError};
use crate::file::FileError;

/// A policy that could not be loaded.
#[derive(Debug, Error)]
#[error("{spec}: {kind}")]
pub struct PolicyError {
    /// Its name or its path.
    pub spec: String,
    /// Why.
    #[source]
    pub kind: PolicyErrorKind,
}

/// The kinds of [`PolicyError`].
#[derive(Debug, Error)]
pub enum PolicyErrorKind {
    /// There is neither a policy nor a file of that name.
    #[error(
        "expected scripted, zero, random, lqr or a file of weights; found neither a policy nor a \
         file of that name"
    )]
    Missing,
    /// It is something else than a file.
    #[error("expected a file of weights, found {0}")]
    NoFile(&'static str),
    /// The system does not let it be read.
    #[error("expected a file of weights, found one that cannot be read: {0}")]
    Unreadable(io::Error),
    /// It is larger than any policy.
    #[error("expected a file of weights of {LARGEST_FILE} bytes at most, found {0} bytes")]
    TooLarge(u64),
    /// It is another file by now.
    #[error("expected the content with the SHA-256 {expected}, found another one: {found}")]
    Changed {
        /// The content that was meant.
        expected: Digest,
        /// The content that is there.
        found: Digest,
    },
    /// Its content is no policy for this robot.
    #[error(transparent)]
    Weights(#[from] WeightsError),
    /// Its content is no graph for this robot, or there is nothing to run it.
    #[error(transparent)]
    Onnx(#[from] OnnxError),
    /// The regulator could not be worked out.
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

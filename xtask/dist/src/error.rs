//! Errors of packaging, with remedies.

use std::{io, path::Path};

use thiserror::Error as ThisError;
use zip::result::ZipError;

/// An error of packaging.
#[derive(Debug, ThisError)]
pub enum Error {
    /// An error with a file, a folder or a program.
    #[error("{what}: {why}")]
    Io {
        /// The attempted action and its object.
        what: String,
        /// The error of the operating system.
        why: io::Error,
    },
    /// The output of cargo's metadata is invalid.
    #[error("cargo metadata: {0}")]
    Metadata(#[from] cargo_metadata::Error),
    /// A wheel cannot contain a file.
    #[error("the wheel cannot be written: {0}")]
    Wheel(#[from] ZipError),
    /// MuJoCo's library or its licences are missing.
    #[error("{0}")]
    Mujoco(#[from] xtask::mujoco::Error),
    /// A tool, or what it made, is of no use: the reason, and what to try.
    #[error("{0}")]
    Unfit(String),
}

impl Error {
    /// Returns an error of the operating system during the action `what` on `path`.
    pub fn io(what: &str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        let what = format!("cannot {what} {}", path.display());
        move |why| Self::Io { what, why }
    }

    /// Returns the `tool` does not say its `what`.
    pub(crate) fn silent(tool: &str, what: &str) -> Self {
        Self::Unfit(format!("{tool} does not say its {what}"))
    }
}

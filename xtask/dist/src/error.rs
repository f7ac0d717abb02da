//! Errors of packaging, with remedies.

use std::{
    io,
    path::{Path, PathBuf},
    process::ExitStatus,
};

use thiserror::Error as ThisError;
use zip::result::ZipError;

/// An error of packaging.
#[derive(Debug, ThisError)]
pub enum Error {
    /// A tool is not installed.
    #[error("{tool} is missing: {remedy}")]
    Missing {
        /// The tool's command.
        tool: &'static str,
        /// How to install it, or do without.
        remedy: &'static str,
    },
    /// A program failed.
    #[error("{what} ended with {status}")]
    Ended {
        /// The program.
        what: String,
        /// Its exit status.
        status: ExitStatus,
    },
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
    /// A file contains the path of a folder of this machine.
    #[error("{file} names {folder}, a folder of this machine: nothing was written")]
    NamesFolder {
        /// The file in the package.
        file: String,
        /// The folder.
        folder: String,
    },
    /// The program needs a newer glibc than the one it was linked for.
    #[error("the program needs glibc 2.{needs}, and was to be linked for 2.{wanted}")]
    Glibc {
        /// The minor version it needs, N in 2.N.
        needs: u32,
        /// The intended minor version, N in 2.N.
        wanted: u32,
    },
    /// A crate without a licence text, whose licence is unknown.
    #[error("{name}: no licence text is in the crate, and {expression:?} is not known by SPDX")]
    Licence {
        /// The crate.
        name: String,
        /// Its licence expression.
        expression: String,
    },
    /// The output of a tool is unusable.
    #[error("{tool} does not say its {what}")]
    Silent {
        /// The tool's command.
        tool: &'static str,
        /// The expected output.
        what: &'static str,
    },
}

impl Error {
    /// An error of the operating system during the action `what` on `path`.
    pub fn io(what: &str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        let what = format!("cannot {what} {}", PathBuf::from(path).display());
        move |why| Self::Io { what, why }
    }
}

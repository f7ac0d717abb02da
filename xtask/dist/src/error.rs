//! Why there is no package, and what to do then.

use std::{
    io,
    path::{Path, PathBuf},
    process::ExitStatus,
};

use thiserror::Error as ThisError;
use zip::result::ZipError;

/// Why there is no package.
#[derive(Debug, ThisError)]
pub enum Error {
    /// A tool is not installed.
    #[error("{tool} is missing: {remedy}")]
    Missing {
        /// The tool's command.
        tool: &'static str,
        /// How to get it, or do without.
        remedy: &'static str,
    },
    /// A program did not succeed.
    #[error("{what} ended with {status}")]
    Ended {
        /// What was run.
        what: String,
        /// How it ended.
        status: ExitStatus,
    },
    /// A file, a folder or a program refused.
    #[error("{what}: {why}")]
    Io {
        /// What was tried, and with what.
        what: String,
        /// The system's reason.
        why: io::Error,
    },
    /// cargo describes the workspace in an unknown way.
    #[error("cargo metadata: {0}")]
    Metadata(#[from] cargo_metadata::Error),
    /// A wheel cannot hold a file.
    #[error("the wheel cannot be written: {0}")]
    Wheel(#[from] ZipError),
    /// MuJoCo's library or its licences are not there.
    #[error("{0}")]
    Mujoco(#[from] xtask::mujoco::Error),
    /// A file names a folder of this machine.
    #[error("{file} names {folder}, a folder of this machine: nothing was written")]
    NamesFolder {
        /// The file in the package.
        file: String,
        /// The folder.
        folder: String,
    },
    /// The program asks for a newer glibc than it was linked for.
    #[error("the program needs glibc 2.{needs}, and was to be linked for 2.{wanted}")]
    Glibc {
        /// N of 2.N.
        needs: u32,
        /// N of 2.N.
        wanted: u32,
    },
    /// A crate comes without a licence text, and with none that is known.
    #[error("{name}: no licence text is in the crate, and {expression:?} is not known by SPDX")]
    Licence {
        /// The crate.
        name: String,
        /// What it says of its licence.
        expression: String,
    },
    /// A tool says nothing that can be used.
    #[error("{tool} does not say its {what}")]
    Silent {
        /// The tool's command.
        tool: &'static str,
        /// What it was asked for.
        what: &'static str,
    },
}

impl Error {
    /// An error of the system while trying `what` with `path`.
    pub fn io(what: &str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        let what = format!("cannot {what} {}", PathBuf::from(path).display());
        move |why| Self::Io { what, why }
    }
}

//! Errors of set-up, with remedies.

use std::error;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use super::{DYNAMIC_LINK_DIR, VERSION};

/// An error of set-up. Its text is the cause and the remedy, a line each.
#[derive(Debug)]
pub enum Error {
    /// No wheel is pinned for this platform.
    Platform(String),
    /// None of these programs is a working Python.
    NoPython(String),
    /// This Python has no pip.
    NoPip(String),
    /// The downloaded wheel is not the pinned one.
    Hash {
        /// The file with the pin.
        requirements: PathBuf,
        /// The output of pip.
        said: String,
    },
    /// pip downloaded no wheel; contains its output.
    Download(String),
    /// Unpacking the wheel failed; contains Python's output.
    Unpack(String),
    /// The unpacked library has an unexpected size.
    Size {
        /// Its size in bytes.
        found: u64,
        /// The expected size in bytes.
        wanted: u64,
    },
    /// An error with a file or folder.
    Io {
        /// The attempted action, as in "cannot write".
        action: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
}

impl Error {
    pub(super) fn io(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::Io {
            action,
            path: path.into(),
            source,
        }
    }

    fn remedy(&self) -> &'static str {
        match self {
            Self::Platform(_) => "Linux (glibc) and macOS on x86-64 and ARM are known.",
            Self::NoPython(_) => {
                "Install Python 3 with pip, or set PYTHON to one; then run the same command again."
            }
            Self::NoPip(_) => {
                "Install pip for it (Debian, Ubuntu: apt install python3-pip), or set PYTHON to a \
                 Python that has pip; then run the same command again."
            }
            Self::Hash { .. } => {
                "Nothing of it was kept. Check which package index pip uses (a mirror, a proxy, \
                 find-links); then run the same command again."
            }
            Self::Download(_) => {
                "Check the network, pip's settings (index, proxy) and its age (20.3 or newer); then run \
                 the same command again. It is needed only once."
            }
            Self::Unpack(_) | Self::Size { .. } => {
                "Nothing of it was kept. Check the free disk space; then run the same command again."
            }
            Self::Io { .. } => {
                "Check the folder's permissions and the free disk space; then run the same command \
                 again."
            }
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "MuJoCo {VERSION} is not set up: ")?;
        match self {
            Self::Platform(name) => write!(f, "no library is known for {name}."),
            Self::NoPython(tried) => write!(f, "no Python starts (tried: {tried})."),
            Self::NoPip(python) => write!(f, "{python} has no pip."),
            Self::Hash { requirements, said } => {
                let pin = requirements.display();
                write!(
                    f,
                    "the wheel that came is not the one pinned in {pin} ({said})."
                )
            }
            Self::Download(said) => write!(f, "pip could not download its wheel ({said})."),
            Self::Unpack(said) => write!(f, "its wheel could not be unpacked ({said})."),
            Self::Size { found, wanted } => {
                write!(f, "its library has {found} bytes, not {wanted}.")
            }
            Self::Io {
                action,
                path,
                source,
            } => {
                write!(f, "cannot {action} {} ({source}).", path.display())
            }
        }?;
        write!(
            f,
            "\n{}\nOr unpack the official release (https://github.com/google-deepmind/mujoco/releases/tag/{VERSION}) \
             and set {DYNAMIC_LINK_DIR} to the absolute path of its lib folder.",
            self.remedy()
        )
    }
}

impl error::Error for Error {
    fn source(&self) -> Option<&(dyn error::Error + 'static)> {
        match self {
            Self::Io { source, .. } => Some(source),
            _ => None,
        }
    }
}

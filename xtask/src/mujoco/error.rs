//! Errors of set-up, with remedies.

use std::{error, fmt, io, path::Path};

use super::{DYNAMIC_LINK_DIR, VERSION};

/// An error of set-up. Its text is the cause and the remedy, a line each.
#[derive(Debug)]
pub struct Error {
    cause: String,
    remedy: &'static str,
}

/// The remedies.
pub(super) mod remedy {
    pub const PLATFORM: &str = "Linux (glibc) and macOS on x86-64 and ARM are known.";
    pub const PYTHON: &str =
        "Install Python 3 with pip, or set PYTHON to one; then run the same command again.";
    pub const PIP: &str = "Install pip for it (Debian, Ubuntu: apt install python3-pip), or set PYTHON to a Python \
         that has pip; then run the same command again.";
    pub const INDEX: &str = "Nothing of it was kept. Check which package index pip uses (a mirror, a proxy, \
         find-links); then run the same command again.";
    pub const NETWORK: &str = "Check the network, pip's settings (index, proxy) and its age (20.3 or newer); then run \
         the same command again. It is needed only once.";
    pub const SPACE: &str =
        "Nothing of it was kept. Check the free disk space; then run the same command again.";
    pub const FOLDER: &str =
        "Check the folder's permissions and the free disk space; then run the same command again.";
}

impl Error {
    pub(super) fn new(cause: impl Into<String>, remedy: &'static str) -> Self {
        Self {
            cause: cause.into(),
            remedy,
        }
    }

    /// pip downloaded no wheel.
    pub(super) fn download(said: &str) -> Self {
        let cause = format!("pip could not download its wheel ({said}).");
        Self::new(cause, remedy::NETWORK)
    }

    /// Returns an error of the operating system during an `action` on `path`, as in "cannot write".
    pub(super) fn io(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        move |why| {
            let cause = format!("cannot {action} {} ({why}).", path.display());
            Self::new(cause, remedy::FOLDER)
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { cause, remedy } = self;
        write!(
            f,
            "MuJoCo {VERSION} is not set up: {cause}\n{remedy}\n\
             Or unpack the official release (https://github.com/google-deepmind/mujoco/releases/tag/{VERSION}) \
             and set {DYNAMIC_LINK_DIR} to the absolute path of its lib folder."
        )
    }
}

impl error::Error for Error {}

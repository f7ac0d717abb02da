//! Errors of set-up, and a folder for what is unfinished.

use std::{
    error, fmt, fs, io,
    path::{Path, PathBuf},
    process,
};

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

const PREFIX: &str = "partial-";

/// A temporary folder beside the target, so that moving the result there is one atomic
/// rename. Removed on drop.
pub(super) struct Scratch(PathBuf);

impl Scratch {
    /// Creates the folder, after removing leftovers of killed set-ups: the caller holds
    /// the lock, so no other set-up uses them. A leftover that resists, because pip of a
    /// killed set-up still writes to it, is removed the next time.
    pub(super) fn new(beside: &Path) -> Result<Self, Error> {
        for stale in leftovers(beside) {
            let _ = fs::remove_dir_all(stale);
        }
        // A unique name avoids conflicts with that pip.
        let path = beside.join(format!("{PREFIX}{}", process::id()));
        fs::create_dir(&path).map_err(Error::io("create", &path))?;
        Ok(Self(path))
    }

    pub(super) fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // An error is ignored, because the next set-up removes leftovers.
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn leftovers(folder: &Path) -> impl Iterator<Item = PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries
        .filter(|entry| entry.file_name().to_string_lossy().starts_with(PREFIX))
        .map(|entry| entry.path())
}

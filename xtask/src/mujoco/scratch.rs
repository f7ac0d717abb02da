//! The folder in which a fetch happens, gone whatever comes of it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process;

use super::Error;

const PREFIX: &str = "partial-";

/// A temporary folder beside the target, so that moving the result there is one
/// atomic rename. Removed on drop.
pub(super) struct Scratch(PathBuf);

impl Scratch {
    /// Creates the folder, after removing what killed set-ups left behind: the
    /// caller holds the lock, so whatever is there belongs to nobody. What resists,
    /// because a killed set-up's pip still writes to it, goes the next time.
    pub(super) fn new(beside: &Path) -> Result<Self, Error> {
        for stale in leftovers(beside) {
            let _ = fs::remove_dir_all(stale);
        }
        // A name of its own keeps clear of that pip, too.
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
        // Nothing to tell anyone: the next set-up removes what stays.
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn leftovers(folder: &Path) -> impl Iterator<Item = PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries
        .filter(|entry| entry.file_name().to_string_lossy().starts_with(PREFIX))
        .map(|entry| entry.path())
}

//! The temporary folder of a download, which is always removed.

use std::fs;
use std::path::{Path, PathBuf};
use std::process;

use super::Error;

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

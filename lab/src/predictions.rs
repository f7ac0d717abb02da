//! The files of this user: predictions, and whether the lab has been opened before.

use std::{
    env, fs,
    path::{Path, PathBuf},
};

use directories::ProjectDirs;

/// Name of the file.
pub const FILE: &str = "answers.toml";

/// Folder of the exercises in a clone.
const FOLDER: &str = "exercises";

/// A file that distinguishes this folder from others of the same name.
const MARK: &str = "bands.toml";

/// Returns the file `named`, or else the one of the current clone, or else the one of this user, or
/// else one in the current folder.
pub fn answers_file(named: Option<&Path>) -> PathBuf {
    let file = named
        .map(Path::to_owned)
        .or_else(in_the_clone)
        .or_else(user_file);
    file.unwrap_or_else(|| PathBuf::from(FILE))
}

fn in_the_clone() -> Option<PathBuf> {
    let here = env::current_dir().ok()?;
    let folder = here
        .ancestors()
        .map(|folder| folder.join(FOLDER))
        .find(|folder| folder.join(MARK).exists())?;
    Some(folder.join(FILE))
}

/// Such as `~/.local/share/ratelab/answers.toml`; `None` without a home folder.
fn user_file() -> Option<PathBuf> {
    let folders = ProjectDirs::from("", "", "ratelab")?;
    Some(folders.data_dir().join(FILE))
}

/// Name of the file that remembers it.
const MARK_FILE: &str = "started";

/// Returns whether the lab was never open before, as far as this machine remembers.
pub fn is_first() -> bool {
    mark().is_some_and(|mark| !mark.exists())
}

/// Remembers that the lab was open. A folder that cannot be written to forgets it.
pub fn remember() {
    let written = mark().map(|mark| {
        let folder = mark.parent().unwrap_or(&mark);
        fs::create_dir_all(folder).and_then(|()| fs::write(&mark, ""))
    });
    drop(written);
}

fn mark() -> Option<PathBuf> {
    let folders = ProjectDirs::from("", "", "ratelab")?;
    let folder = folders.state_dir().unwrap_or(folders.data_dir());
    Some(folder.join(MARK_FILE))
}

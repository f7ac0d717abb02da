//! The first start of the lab by this user.

use std::{fs, path::PathBuf};

use directories::ProjectDirs;

/// Name of the file that remembers it.
const FILE: &str = "started";

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
    Some(folder.join(FILE))
}

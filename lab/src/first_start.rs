//! The first start of the lab by this user.

use std::fs;

use directories::ProjectDirs;

/// Name of the file that remembers it.
const FILE: &str = "started";

/// Whether the lab starts for the first time. A folder that cannot be written to forgets
/// it.
pub fn is_first() -> bool {
    let Some(folders) = ProjectDirs::from("", "", "ratelab") else {
        return false;
    };
    let folder = folders.state_dir().unwrap_or(folders.data_dir());
    let mark = folder.join(FILE);
    if mark.exists() {
        return false;
    }
    let _ = fs::create_dir_all(folder).and_then(|()| fs::write(mark, ""));
    true
}

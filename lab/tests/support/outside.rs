//! A folder outside of a clone, for tests of an installed ratelab.

use std::path::Path;

/// The file by which the exercises recognise a clone.
const MARK: &str = "exercises/bands.toml";

/// # Panics
/// If `folder` lies in a clone: ratelab would then use the files there.
pub fn assert_outside(folder: &Path) {
    let mut around = folder.ancestors();
    let clone = around.find(|folder| folder.join(MARK).exists());
    assert!(
        clone.is_none(),
        "the folder for temporary files lies in a clone, {}: set TMPDIR to one outside",
        clone.unwrap_or(folder).display()
    );
}

//! Tests of what ratelab does outside of a clone need a folder that is.

use std::path::Path;

/// What tells a clone to the exercises.
const MARK: &str = "exercises/bands.toml";

/// # Panics
/// If `folder` lies in a clone: ratelab would then use what is there.
pub fn assert_outside(folder: &Path) {
    let mut around = folder.ancestors();
    let clone = around.find(|folder| folder.join(MARK).exists());
    assert!(
        clone.is_none(),
        "the folder for temporary files lies in a clone, {}: set TMPDIR to one outside",
        clone.unwrap_or(folder).display()
    );
}

//! The clone under test.

use std::{env, path::PathBuf};

/// Path of its folder.
pub fn root() -> PathBuf {
    // Read at run time: the clone may have moved since compilation.
    let tests = env::var_os("CARGO_MANIFEST_DIR")
        .map_or_else(|| env!("CARGO_MANIFEST_DIR").into(), PathBuf::from);
    tests.join("..")
}

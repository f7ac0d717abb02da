//! The clone that is tested.

use std::{env, path::PathBuf};

/// Its folder.
pub fn root() -> PathBuf {
    // Read while running: the clone may have moved since this was compiled.
    let dir = env::var_os("CARGO_MANIFEST_DIR");
    dir.map_or_else(|| env!("CARGO_MANIFEST_DIR").into(), PathBuf::from)
}

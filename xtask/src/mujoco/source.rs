//! The source of MuJoCo for a build: the fetched library or the user's own.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};

/// Environment variable with the folder of a shared MuJoCo; `.cargo/config.toml` sets it
/// to the fetched one, and the user's environment overrides that.
pub const DYNAMIC_LINK_DIR: &str = "MUJOCO_DYNAMIC_LINK_DIR";

/// Environment variable with the folder of a static MuJoCo; mujoco-rs prefers it to a
/// shared one.
pub const STATIC_LINK_DIR: &str = "MUJOCO_STATIC_LINK_DIR";

/// The source of MuJoCo for a build.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// The library fetched by set-up.
    Fetched,
    /// The user's own library, in this folder.
    Own(PathBuf),
    /// The library found by pkg-config: no variable is set.
    System,
}

impl Source {
    /// Reads the environment like mujoco-rs; `ours` is the folder of the fetched library.
    #[must_use]
    pub fn from_env(ours: &Path) -> Self {
        if let Some(dir) = env::var_os(STATIC_LINK_DIR) {
            return Self::Own(dir.into());
        }
        match env::var_os(DYNAMIC_LINK_DIR).map(PathBuf::from) {
            None => Self::System,
            Some(dir) if is_same(&dir, ours) => Self::Fetched,
            Some(dir) => Self::Own(dir),
        }
    }
}

/// Compares the resolved paths, because a clone may be reached through a link.
fn is_same(a: &Path, b: &Path) -> bool {
    match (fs::canonicalize(a), fs::canonicalize(b)) {
        (Ok(a), Ok(b)) => a == b,
        _ => a == b,
    }
}

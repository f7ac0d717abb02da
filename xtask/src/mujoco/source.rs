//! Where a build takes MuJoCo from: the fetched library or one of the user's.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};

/// Names the folder of a shared MuJoCo; `.cargo/config.toml` sets it to ours,
/// and the user's environment overrides that.
pub const DYNAMIC_LINK_DIR: &str = "MUJOCO_DYNAMIC_LINK_DIR";

/// Names the folder of a static MuJoCo; mujoco-rs prefers it to a shared one.
pub const STATIC_LINK_DIR: &str = "MUJOCO_STATIC_LINK_DIR";

/// Where a build takes MuJoCo from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// The library that set-up fetches.
    Fetched,
    /// The user's own library, in this folder.
    Own(PathBuf),
    /// Whatever pkg-config finds: no variable is set.
    System,
}

impl Source {
    /// Reads the environment as mujoco-rs does; `ours` is the folder set-up fills.
    #[must_use]
    pub fn of_build(ours: &Path) -> Self {
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

/// Compares what the paths lead to: a clone may be reached through a link.
fn is_same(a: &Path, b: &Path) -> bool {
    match (fs::canonicalize(a), fs::canonicalize(b)) {
        (Ok(a), Ok(b)) => a == b,
        _ => a == b,
    }
}

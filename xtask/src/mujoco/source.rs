//! The source of MuJoCo for a build, and the library of each platform.

use std::{
    env::{
        self,
        consts::{ARCH, OS},
    },
    fs,
    path::{Path, PathBuf},
};

use super::error::{Error, remedy};

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

/// The wheel of one platform, and the places of its library.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Platform {
    /// pip's name for the platform.
    pub tag: &'static str,
    /// Path of the library in the wheel.
    pub member: &'static str,
    /// Size of the library in bytes.
    pub size: u64,
    /// Paths where linker and loader search for it, relative to the folder of set-up.
    pub places: &'static [&'static str],
}

const LINUX_X86_64: Platform = Platform {
    tag: "manylinux_2_28_x86_64",
    member: "mujoco/libmujoco.so.3.17.0",
    size: 7_252_544,
    places: &["libmujoco.so.3.17.0"],
};

const LINUX_AARCH64: Platform = Platform {
    tag: "manylinux_2_28_aarch64",
    size: 6_594_304,
    ..LINUX_X86_64
};

/// One library for both processors. The linker needs the plain name; the loader needs the
/// path for which the library was built.
const MACOS: Platform = Platform {
    tag: "macosx_11_0_arm64",
    member: "mujoco/libmujoco.3.17.0.dylib",
    size: 11_545_112,
    places: &[
        "mujoco.framework/Versions/A/libmujoco.3.17.0.dylib",
        "libmujoco.dylib",
    ],
};

impl Platform {
    /// Returns the platform for a target's operating system, processor and C library, in cargo's
    /// terms.
    ///
    /// # Errors
    /// If no wheel is pinned for it.
    pub fn find(os: &str, arch: &str, libc: &str) -> Result<&'static Self, Error> {
        match (os, arch, libc) {
            ("linux", "x86_64", "gnu") => Ok(&LINUX_X86_64),
            ("linux", "aarch64", "gnu") => Ok(&LINUX_AARCH64),
            ("macos", "x86_64" | "aarch64", _) => Ok(&MACOS),
            _ => {
                let name = format!("{os} {arch} {libc}");
                let cause = format!("no library is known for {}.", name.trim());
                Err(Error::new(cause, remedy::PLATFORM))
            }
        }
    }

    /// Returns the platform of this program.
    ///
    /// # Errors
    /// If no wheel is pinned for it.
    pub fn host() -> Result<&'static Self, Error> {
        let libc = if cfg!(target_env = "gnu") { "gnu" } else { "" };
        Self::find(OS, ARCH, libc)
    }

    /// Returns the target platform of a build script, which may differ from the host.
    ///
    /// # Errors
    /// If no wheel is pinned for it.
    pub fn for_build() -> Result<&'static Self, Error> {
        let cfg = |name| env::var(format!("CARGO_CFG_TARGET_{name}")).unwrap_or_default();
        Self::find(&cfg("OS"), &cfg("ARCH"), &cfg("ENV"))
    }
}

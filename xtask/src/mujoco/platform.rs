//! The platforms for which a wheel is pinned, and what each wheel holds.

use std::env;
use std::env::consts::{ARCH, OS};

use super::Error;

/// One platform's wheel, and where its library goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Platform {
    /// What pip calls the platform.
    pub tag: &'static str,
    /// The library's path in the wheel.
    pub member: &'static str,
    /// The library's size in bytes.
    pub size: u64,
    /// Where linker and loader look for it, relative to the set-up's folder.
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

/// One library for both processors. The linker wants the plain name; the loader
/// wants the path that the library was built to be found under.
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
    /// The platform for a target's operating system, processor and C library, in
    /// cargo's words.
    ///
    /// # Errors
    /// When no wheel is pinned for it.
    pub fn of(os: &str, arch: &str, libc: &str) -> Result<&'static Self, Error> {
        match (os, arch, libc) {
            ("linux", "x86_64", "gnu") => Ok(&LINUX_X86_64),
            ("linux", "aarch64", "gnu") => Ok(&LINUX_AARCH64),
            ("macos", "x86_64" | "aarch64", _) => Ok(&MACOS),
            _ => Err(Error::Platform(format!("{os} {arch} {libc}").trim().into())),
        }
    }

    /// The platform this program runs on.
    ///
    /// # Errors
    /// When no wheel is pinned for it.
    pub fn host() -> Result<&'static Self, Error> {
        let libc = if cfg!(target_env = "gnu") { "gnu" } else { "" };
        Self::of(OS, ARCH, libc)
    }

    /// The platform a build script builds for, which need not be the host.
    ///
    /// # Errors
    /// When no wheel is pinned for it.
    pub fn of_build() -> Result<&'static Self, Error> {
        let cfg = |name| env::var(format!("CARGO_CFG_TARGET_{name}")).unwrap_or_default();
        Self::of(&cfg("OS"), &cfg("ARCH"), &cfg("ENV"))
    }
}

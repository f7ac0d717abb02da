//! The platform of a wheel, read from the program and the library in it.

use std::env::consts::{ARCH, OS};

/// The oldest macOS supported by MuJoCo's library, and so by the program.
pub(crate) const MACOS: &str = "11.0";

/// The oldest glibc known to pip, as N in 2.N.
const OLDEST_GLIBC: u32 = 17;

/// pip's name for the platform of `files`.
#[must_use]
pub fn wheel_tag(files: &[&[u8]]) -> String {
    if OS == "macos" {
        let arch = if ARCH == "aarch64" { "arm64" } else { ARCH };
        return format!("macosx_{}_{arch}", MACOS.replace('.', "_"));
    }
    let newest = files
        .iter()
        .map(|file| glibc(file))
        .max()
        .unwrap_or(OLDEST_GLIBC);
    format!("manylinux_2_{newest}_{ARCH}")
}

/// Returns the glibc that a program or library needs, as N in 2.N: the newest version of any symbol
/// in it, and at least the oldest known to pip.
#[must_use]
pub fn glibc(file: &[u8]) -> u32 {
    const VERSION: &[u8] = b"GLIBC_2.";
    let found = file.windows(VERSION.len()).enumerate();
    let ends = found.filter_map(|(at, w)| (w == VERSION).then_some(at + VERSION.len()));
    let newest = ends.filter_map(|at| number(&file[at..])).max();
    newest.unwrap_or_default().max(OLDEST_GLIBC)
}

/// Returns the number of one or two digits at the start of `bytes`.
fn number(bytes: &[u8]) -> Option<u32> {
    let digits = bytes.iter().take_while(|byte| byte.is_ascii_digit());
    let digits: String = digits.map(|&byte| char::from(byte)).collect();
    digits.parse().ok().filter(|&number| number < 100)
}

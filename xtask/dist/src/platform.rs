//! The machine of a build, and the platform that it builds for.

use std::{
    env::{
        self,
        consts::{ARCH, OS},
    },
    path::{Path, PathBuf},
    process::Command,
};

use crate::Error;

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
    let ends = file
        .windows(VERSION.len())
        .enumerate()
        .filter_map(|(at, w)| (w == VERSION).then_some(at + VERSION.len()));
    let newest = ends.filter_map(|at| number(&file[at..])).max();
    newest.unwrap_or_default().max(OLDEST_GLIBC)
}

/// Returns the number of one or two digits at the start of `bytes`.
fn number(bytes: &[u8]) -> Option<u32> {
    let digits: String = bytes
        .iter()
        .take_while(|byte| byte.is_ascii_digit())
        .map(|&byte| char::from(byte))
        .collect();
    digits.parse().ok().filter(|&number| number < 100)
}

/// The inputs of a build from this machine, and the paths that must not leave it.
#[derive(Clone, Debug)]
pub struct Machine {
    /// Folder of the clone.
    pub root: PathBuf,
    /// Folder of the toolchain.
    pub sysroot: PathBuf,
    /// cargo's folder, with the sources of all crates.
    pub cargo_home: PathBuf,
    /// The target triple of rustc.
    pub target: String,
    /// The date for packed files, in seconds since 1970: that of the commit.
    pub time: u64,
}

impl Machine {
    /// Reads the machine's properties from rustc and git; `root` is the clone.
    /// `SOURCE_DATE_EPOCH` in the environment replaces the date of the commit.
    ///
    /// # Errors
    /// If rustc is missing.
    pub fn ask(root: &Path) -> Result<Self, Error> {
        let silent = |what| Error::silent("rustc", what);
        let about = said(Command::new("rustc").arg("-vV")).ok_or_else(|| silent("version"))?;
        let target = about.lines().find_map(|line| line.strip_prefix("host: "));
        let sysroot = said(Command::new("rustc").args(["--print", "sysroot"]));
        let cargo_home = env::var_os("CARGO_HOME").map(PathBuf::from);
        Ok(Self {
            root: root.canonicalize().map_err(Error::io("find", root))?,
            sysroot: sysroot.ok_or_else(|| silent("sysroot"))?.into(),
            cargo_home: cargo_home.unwrap_or_else(|| home().join(".cargo")),
            target: target.ok_or_else(|| silent("host"))?.to_owned(),
            time: time(root),
        })
    }

    /// Folders of this machine, whose paths must not appear in a package.
    #[must_use]
    pub fn folders(&self) -> Vec<String> {
        let known = [&self.root, &self.sysroot, &self.cargo_home, &home()];
        // Without a stroke at the end, which a variable may have.
        let texts = known
            .map(|folder| folder.components().collect::<PathBuf>())
            .map(|folder| folder.display().to_string());
        // The home of a service may be "/" or "".
        texts.into_iter().filter(|name| name.len() > 1).collect()
    }

    /// Returns the folder of the fetched MuJoCo.
    #[must_use]
    pub fn mujoco(&self) -> PathBuf {
        self.root.join("xtask/mujoco")
    }

    /// Returns the folder for builds and packages.
    #[must_use]
    pub fn packages(&self) -> PathBuf {
        self.root.join("target/packages")
    }

    /// Returns whether git finds no changes since the commit.
    #[must_use]
    pub fn is_clean(&self) -> bool {
        let mut git = Command::new("git");
        git.args(["status", "--porcelain"]).current_dir(&self.root);
        said(&mut git).is_some_and(|changes| changes.is_empty())
    }
}

fn home() -> PathBuf {
    env::home_dir().unwrap_or_default()
}

/// Returns a copy without history gets the earliest date of a zip file.
fn time(root: &Path) -> u64 {
    const ZIP_BEGINS: u64 = 315_532_800;
    let mut git = Command::new("git");
    git.args(["log", "-1", "--no-show-signature", "--format=%ct"]);
    env::var("SOURCE_DATE_EPOCH")
        .ok()
        .or_else(|| said(git.current_dir(root)))
        .and_then(|time| time.parse().ok())
        .unwrap_or(ZIP_BEGINS)
}

/// Returns the output of `command`, if it runs and succeeds.
pub(crate) fn said(command: &mut Command) -> Option<String> {
    let output = command.output().ok()?;
    let said = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| said.trim().to_owned())
}

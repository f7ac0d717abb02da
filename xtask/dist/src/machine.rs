//! The machine that builds: its toolchain, its folders, the clone's date.

use std::{
    env,
    path::{Path, PathBuf},
    process::Command,
};

use crate::Error;

/// What the build is told of the machine, and what it must not hand on.
#[derive(Clone, Debug)]
pub struct Machine {
    /// The clone.
    pub root: PathBuf,
    /// The toolchain.
    pub sysroot: PathBuf,
    /// cargo's folder, with the sources of all crates.
    pub cargo_home: PathBuf,
    /// What rustc calls this platform.
    pub target: String,
    /// The date of what is packed, in seconds since 1970: that of the commit.
    pub time: u64,
}

impl Machine {
    /// Asks rustc and git; `root` is the clone. `SOURCE_DATE_EPOCH` in the
    /// environment replaces the date of the commit.
    ///
    /// # Errors
    /// When there is no rustc.
    pub fn ask(root: &Path) -> Result<Self, Error> {
        let silent = |what| Error::Silent {
            tool: "rustc",
            what,
        };
        let about = said(Command::new("rustc").arg("-vV")).ok_or(silent("version"))?;
        let target = about.lines().find_map(|line| line.strip_prefix("host: "));
        let sysroot = said(Command::new("rustc").args(["--print", "sysroot"]));
        let cargo_home = env::var_os("CARGO_HOME").map(PathBuf::from);
        Ok(Self {
            root: root.canonicalize().map_err(Error::io("find", root))?,
            sysroot: sysroot.ok_or(silent("sysroot"))?.into(),
            cargo_home: cargo_home.unwrap_or_else(|| home().join(".cargo")),
            target: target.ok_or(silent("host"))?.to_owned(),
            time: time(root),
        })
    }

    /// Folders of this machine, which nothing that leaves it may name.
    #[must_use]
    pub fn folders(&self) -> Vec<String> {
        let known = [&self.root, &self.sysroot, &self.cargo_home, &home()];
        let known = known.map(|folder| folder.display().to_string());
        // The home of a service may be "/" or "".
        known.into_iter().filter(|name| name.len() > 1).collect()
    }

    /// The folder in which set-up keeps MuJoCo.
    #[must_use]
    pub fn mujoco(&self) -> PathBuf {
        self.root.join("xtask/mujoco")
    }

    /// The folder for what is built and packed.
    #[must_use]
    pub fn packages(&self) -> PathBuf {
        self.root.join("target/packages")
    }

    /// Whether git finds nothing that is not in the commit.
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

/// A copy without history has the first date that a zip file knows.
fn time(root: &Path) -> u64 {
    const ZIP_BEGINS: u64 = 315_532_800;
    let mut git = Command::new("git");
    git.args(["log", "-1", "--no-show-signature", "--format=%ct"]);
    let given = env::var("SOURCE_DATE_EPOCH").ok();
    let time = given.or_else(|| said(git.current_dir(root)));
    let time = time.and_then(|time| time.parse().ok());
    time.unwrap_or(ZIP_BEGINS)
}

/// What `command` prints, if it can be run and succeeds.
pub(crate) fn said(command: &mut Command) -> Option<String> {
    let output = command.output().ok()?;
    let said = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| said.trim().to_owned())
}

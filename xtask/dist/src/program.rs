//! Builds the program for a package.

use std::{
    env,
    ffi::OsString,
    fs,
    path::PathBuf,
    process::{Command, ExitStatus},
};

use xtask::mujoco::{DYNAMIC_LINK_DIR, STATIC_LINK_DIR};

use crate::{
    Error, Machine, glibc,
    platform::{MACOS, said},
};

/// N of 2.N: RHEL 8, Debian 10 and later.
const GLIBC: u32 = 28;

/// The program of the packages: with runs in several processes, without TLS.
pub(crate) const PACKAGE: [&str; 4] = ["--package", "ratelab-lab", "--features", "network"];

/// The linker of the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Linker {
    /// zig, on Linux: for glibc 2.28, independent of this machine's version.
    Zig,
    /// The linker of this machine: for its glibc, or for macOS.
    Native,
}

impl Linker {
    /// Checks that its tools are installed.
    ///
    /// # Errors
    /// With the missing tool, and how to install it.
    pub fn check(self) -> Result<(), Error> {
        if self == Self::Zig && said(Command::new("cargo-zigbuild").arg("-V")).is_none() {
            let why = "cargo-zigbuild is missing: python3 -m pip install cargo-zigbuild brings it, \
                       and zig with it; cargo xtask dist --native links for the glibc of this \
                       machine instead";
            return Err(Error::Unfit(why.to_owned()));
        }
        Ok(())
    }

    /// Builds `ratelab` in a separate folder, because its flags differ from other builds.
    /// The first time takes minutes.
    ///
    /// # Errors
    /// If cargo fails, or the program it built is unsuitable.
    pub fn build(self, machine: &Machine) -> Result<Vec<u8>, Error> {
        let folder = machine.packages().join("build");
        succeed("cargo", command(machine, self, &folder).status())?;
        let file = folder.join(&machine.target).join("dist/ratelab");
        let bytes = fs::read(&file).map_err(Error::io("read", &file))?;
        match glibc(&bytes) {
            needs if self == Self::Zig && needs > GLIBC => Err(Error::Unfit(format!(
                "the program needs glibc 2.{needs}, and was to be linked for 2.{GLIBC}"
            ))),
            _ => Ok(bytes),
        }
    }
}

fn command(machine: &Machine, linker: Linker, folder: &PathBuf) -> Command {
    let cargo = env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let (build, target) = match linker {
        Linker::Zig => ("zigbuild", format!("{}.2.{GLIBC}", machine.target)),
        Linker::Native => ("build", machine.target.clone()),
    };
    let mut command = Command::new(cargo);
    command
        .args([build, "--profile", "dist", "--locked"])
        .args(PACKAGE)
        .args(["--target", &target])
        .arg("--target-dir")
        .arg(folder)
        .current_dir(&machine.root)
        .env("CARGO_ENCODED_RUSTFLAGS", flags(machine))
        .env("CARGO_INCREMENTAL", "0")
        .env("MACOSX_DEPLOYMENT_TARGET", MACOS)
        .env("RATELAB_DIST", "1")
        .env("SOURCE_DATE_EPOCH", machine.time.to_string())
        // The packed library is the pinned one, so the program must link that.
        .env_remove(DYNAMIC_LINK_DIR)
        .env_remove(STATIC_LINK_DIR);
    command
}

/// Maps the folders of this machine to fixed names. The last matching one has precedence.
fn flags(machine: &Machine) -> OsString {
    let names = [
        (&machine.root, "/ratelab"),
        (&machine.cargo_home, "/cargo"),
        (&machine.sysroot, "/rust"),
    ];
    let flags = names.map(|(folder, name)| {
        let mut flag = OsString::from("--remap-path-prefix=");
        flag.push(folder);
        flag.push("=");
        flag.push(name);
        flag
    });
    // The separator of flags in cargo.
    flags.join(&OsString::from("\x1f"))
}

/// Returns an error unless the program `what` succeeded.
pub(crate) fn succeed(what: &str, ended: std::io::Result<ExitStatus>) -> Result<(), Error> {
    match ended {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(Error::Unfit(format!("{what} ended with {status}"))),
        Err(why) => Err(Error::Io {
            what: format!("cannot run {what}"),
            why,
        }),
    }
}

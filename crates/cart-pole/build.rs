//! Provides MuJoCo's library for linking and, later, for loading.

use std::env;
use std::path::{Path, PathBuf};

use xtask::mujoco::{self, DYNAMIC_LINK_DIR, Error, Platform, STATIC_LINK_DIR, Source};

fn main() {
    println!("cargo::rerun-if-env-changed={DYNAMIC_LINK_DIR}");
    println!("cargo::rerun-if-env-changed={STATIC_LINK_DIR}");

    // Read at run time of the script: the clone may have moved since it was compiled.
    let package = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    let clone = package.ancestors().nth(2).unwrap_or(&package);
    let ours = clone.join("xtask/mujoco");
    match Source::from_env(&ours) {
        Source::Fetched => match fetch(&ours) {
            Ok(()) => load_from(&ours),
            // A directive must be one line.
            Err(error) => println!("cargo::error={}", error.to_string().replace('\n', " ")),
        },
        Source::Own(dir) => load_from(&dir),
        Source::System => {}
    }
}

fn fetch(folder: &Path) -> Result<(), Error> {
    let platform = Platform::for_build()?;
    for place in platform.places {
        println!("cargo::rerun-if-changed=../../xtask/mujoco/{place}");
    }
    mujoco::ensure(folder, platform).map(drop)
}

/// Programs load the library from the folder of linking. A crate's build script can set
/// this for its own programs only, so `lab` gets the folder from here.
fn load_from(dir: &Path) {
    if env::var_os("CARGO_CFG_UNIX").is_some() {
        println!("cargo::rustc-link-arg=-Wl,-rpath,{}", dir.display());
        println!("cargo::metadata=rpath={}", dir.display());
    }
}

//! Says where the programs of this package find MuJoCo's library.

use std::env;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    if let Ok(dir) = env::var("DEP_RATELAB_MUJOCO_RPATH") {
        println!("cargo::rustc-link-arg=-Wl,-rpath,{dir}");
        beside();
    }
}

/// An installed program outlives a clone that moves or goes: it takes a library
/// in `lib/ratelab`, beside the folder that the program is in.
fn beside() {
    let here = match env::var("CARGO_CFG_TARGET_OS").as_deref() {
        Ok("macos") => "@executable_path",
        _ => "$ORIGIN",
    };
    println!("cargo::rustc-link-arg=-Wl,-rpath,{here}/../lib/ratelab");
}

//! Passes on the location of MuJoCo's library to the programs of a package. Several
//! packages use this file.

use std::env;

/// Set by the build script of the cart-pole.
const LIBRARY: &str = "DEP_RATELAB_MUJOCO_RPATH";

fn main() {
    println!("cargo::rerun-if-env-changed={LIBRARY}");
    if let Ok(dir) = env::var(LIBRARY) {
        println!("cargo::rustc-link-arg=-Wl,-rpath,{dir}");
    }
}

//! Passes on the location of MuJoCo's library to the programs of this package.

use std::env;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    if let Ok(dir) = env::var("DEP_RATELAB_MUJOCO_RPATH") {
        println!("cargo::rustc-link-arg=-Wl,-rpath,{dir}");
    }
}

//! Tells the programs of a package where to load MuJoCo's library from. Several packages use this
//! file: those whose tests run the cart-pole, and which need no MuJoCo without them.

use std::env;

/// The folder of the library: `.cargo/config.toml` sets it, or the user's environment.
const FOLDER: &str = "MUJOCO_DYNAMIC_LINK_DIR";

fn main() {
    println!("cargo::rerun-if-env-changed={FOLDER}");
    if env::var_os("CARGO_CFG_UNIX").is_some()
        && let Ok(folder) = env::var(FOLDER)
    {
        println!("cargo::rustc-link-arg=-Wl,-rpath,{folder}");
    }
}

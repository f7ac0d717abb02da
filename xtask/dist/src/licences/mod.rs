//! The licence texts of everything in a package.

mod crates;
mod standard;

pub use crates::{list, viewer};
pub use standard::standard;

use xtask::mujoco::{self, Platform};

use crate::{Error, Linker, Machine, Tree, share::read};

/// Their folder in the tree.
pub const FOLDER: &str = "share/licenses/ratelab";

/// Adds the licences of ratelab, of each crate in it, of MuJoCo, and of the parts added
/// by the compiler and the linker.
///
/// # Errors
/// If one of them is missing: a package must contain all licences.
pub fn add(tree: &mut Tree, machine: &Machine, linker: Linker) -> Result<(), Error> {
    let mut add = |path: &str, text: Vec<u8>| tree.add(format!("{FOLDER}/{path}"), text);
    add("LICENSE", read(&machine.root.join("LICENSE"))?);
    add("crates.txt", list(machine)?.into_bytes());
    for (name, text) in mujoco::licences(&machine.mujoco(), Platform::host()?)? {
        add(&format!("mujoco/{name}"), text);
    }
    for (name, text) in standard::rust(&machine.sysroot)? {
        add(&format!("rust/{name}"), text);
    }
    if linker == Linker::Zig {
        for (name, text) in standard::zig(&machine.root)? {
            add(&format!("zig/{name}"), text);
        }
    }
    Ok(())
}

//! `cargo xtask dist`: a tarball and a Python wheel for this platform.

use std::{
    env,
    env::consts::{ARCH, OS},
    fs,
    path::Path,
    process::ExitCode,
};

use dist::{Error, Linker, Machine, Tree, Wheel, licences, share, tarball, wheel, wheel_tag};
use sha2::{Digest, Sha256};
use xtask::mujoco::{self, Platform};

const USAGE: &str = "\
Usage: cargo xtask dist [--native]

Builds ratelab to be handed out, and packs it as a tarball and as a Python wheel in
target/packages, with MuJoCo's library, recordings, manual pages, completions and
all licences. The first time takes a quarter of an hour.

  --native     on Linux: link for the glibc of this machine, without zig";

fn main() -> ExitCode {
    let arguments: Vec<_> = env::args_os().skip(1).collect();
    // Read at run time: the clone may have moved since compilation.
    let package = env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default();
    let linker = match arguments.as_slice() {
        [] if OS == "linux" => Linker::Zig,
        [] => Linker::Native,
        [native] if native == "--native" => Linker::Native,
        [help] if help == "--help" => {
            println!("{USAGE}");
            return ExitCode::SUCCESS;
        }
        _ => {
            eprintln!("{USAGE}");
            return ExitCode::from(2);
        }
    };
    match pack(&Path::new(&package).join("../.."), linker) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn pack(root: &Path, linker: Linker) -> Result<(), Error> {
    linker.check()?;
    let machine = Machine::ask(root)?;
    if !machine.is_clean() {
        eprintln!("note: the clone holds changes: what is packed is that of no commit");
    }
    let (tree, platform) = tree(&machine, linker)?;
    tree.check_names_none_of(&machine.folders())?;
    let version = env!("CARGO_PKG_VERSION");
    let about = Wheel {
        version: version.to_owned(),
        platform,
        viewer: licences::viewer(&machine)?,
    };
    let name = format!("ratelab-{version}-{ARCH}-{OS}");
    let packed =
        tarball(&tree, &name, machine.time).map_err(Error::io("pack", Path::new(&name)))?;
    let files = [
        (format!("{name}.tar.gz"), packed),
        (about.file_name(), wheel(&tree, &about)?),
    ];
    write(&machine.packages(), &files)
}

/// Returns all files of a package, and pip's name for their platform.
fn tree(machine: &Machine, linker: Linker) -> Result<(Tree, String), Error> {
    let (platform, folder) = (Platform::host()?, machine.mujoco());
    mujoco::ensure(&folder, platform)?;
    let program = linker.build(machine)?;
    let library = platform.places[0];
    let file = folder.join(library);
    let bytes = fs::read(&file).map_err(Error::io("read", &file))?;
    let tag = wheel_tag(&[&program, &bytes]);
    let mut tree = Tree::default();
    tree.add_program("bin/ratelab", program);
    tree.add(format!("lib/ratelab/{library}"), bytes);
    share(
        &mut tree,
        &machine.root,
        &machine.packages().join("unpacked"),
    )?;
    licences::add(&mut tree, machine, linker)?;
    Ok((tree, tag))
}

/// Writes the packages, and their hashes in the form of `sha256sum`.
fn write(folder: &Path, files: &[(String, Vec<u8>)]) -> Result<(), Error> {
    let mut sums = String::new();
    for (name, bytes) in files {
        let path = folder.join(name);
        publish(&path, bytes)?;
        println!("{} ({} bytes)", path.display(), bytes.len());
        sums += &format!("{:x}  {name}\n", Sha256::digest(bytes));
    }
    publish(&folder.join("SHA256SUMS"), sums.as_bytes())?;
    println!("MuJoCo {} is in both.", mujoco::VERSION);
    Ok(())
}

/// Writes a file atomically.
fn publish(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    let staged = path.with_added_extension("part");
    fs::write(&staged, bytes).map_err(Error::io("write", &staged))?;
    fs::rename(&staged, path).map_err(Error::io("write", path))
}

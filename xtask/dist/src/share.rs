//! Files beside the program: recordings, code to read, manual pages, completions.

use std::{
    fs,
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
    process::Command,
};

use crate::{Error, Tree, program::succeed};

/// Files of the clone for users, and their folders in the package: recordings with the
/// knobs file of one of them, and the code that an exercise asks to read.
const SHARED: [(&str, &str, &str); 5] = [
    ("recordings", "balanced-50hz.rrd", "recordings"),
    ("recordings", "fall-5hz.rrd", "recordings"),
    ("recordings", "rescue.knobs", "recordings"),
    ("recordings", "rescued.rrd", "recordings"),
    ("exercises/src/ties", "accumulating.rs", "exercises"),
];

/// Shells, and the folder of each for completions.
const COMPLETIONS: [(&str, &str); 3] = [
    ("bash", "share/bash-completion/completions/ratelab"),
    ("fish", "share/fish/vendor_completions.d/ratelab.fish"),
    ("zsh", "share/zsh/site-functions/_ratelab"),
];

/// Adds the files to `tree`, which contains program and library already. The program
/// itself writes its pages, from a copy in `scratch`: so it has run once, without the
/// clone's library, before it is published.
///
/// # Errors
/// If the program does not run, or a file cannot be read or written.
pub fn share(tree: &mut Tree, root: &Path, scratch: &Path) -> Result<(), Error> {
    let program = unpack(tree, scratch)?;
    let pages = scratch.join("man");
    let mut man = ratelab(&program);
    succeed("ratelab man", man.arg("man").arg(&pages).status())?;
    for page in names(&pages)? {
        tree.add(format!("share/man/man1/{page}"), read(&pages.join(&page))?);
    }
    for (shell, place) in COMPLETIONS {
        let output = ratelab(&program).args(["completions", shell]).output();
        let script = output.map_err(Error::io("run", &program))?;
        succeed("ratelab completions", Ok(script.status))?;
        tree.add(place, script.stdout);
    }
    for (place, name, folder) in SHARED {
        let bytes = read(&root.join(place).join(name))?;
        tree.add(format!("share/ratelab/{folder}/{name}"), bytes);
    }
    Ok(())
}

/// Returns the program, without cargo's help for finding its library.
fn ratelab(program: &Path) -> Command {
    let mut command = Command::new(program);
    command.env_remove("LD_LIBRARY_PATH");
    command.env_remove("DYLD_FALLBACK_LIBRARY_PATH");
    command
}

/// Writes all files into `folder`; returns the path of the program.
fn unpack(tree: &Tree, folder: &Path) -> Result<PathBuf, Error> {
    if folder.exists() {
        fs::remove_dir_all(folder).map_err(Error::io("remove", folder))?;
    }
    for (path, file) in tree.files() {
        let path = folder.join(path);
        let parent = path.parent().unwrap_or(folder);
        fs::create_dir_all(parent).map_err(Error::io("create", parent))?;
        fs::write(&path, &file.bytes).map_err(Error::io("write", &path))?;
        let permissions = fs::Permissions::from_mode(file.mode());
        fs::set_permissions(&path, permissions).map_err(Error::io("write", &path))?;
    }
    Ok(folder.join("bin/ratelab"))
}

/// Returns the names of the files in `folder`.
pub(crate) fn names(folder: &Path) -> Result<Vec<String>, Error> {
    let entries = fs::read_dir(folder).map_err(Error::io("read", folder))?;
    let mut names: Vec<_> = entries
        .flatten()
        .map(|entry| entry.file_name())
        .filter_map(|name| name.into_string().ok())
        .collect();
    names.sort();
    Ok(names)
}

/// Returns the content of `file`.
pub(crate) fn read(file: &Path) -> Result<Vec<u8>, Error> {
    fs::read(file).map_err(Error::io("read", file))
}

//! What the compiler and the linker put into each program: Rust's standard library,
//! and with zig the unwinder and the beginning of glibc.

use std::{path::Path, process::Command};

use crate::{Error, machine::said, share::read};

/// Files by their names.
type Texts = Vec<(&'static str, Vec<u8>)>;

/// Those of Rust's standard library, as the toolchain in `sysroot` brings them.
pub(super) fn rust(sysroot: &Path) -> Result<Texts, Error> {
    const TEXTS: [&str; 5] = [
        "COPYRIGHT-library.html",
        "licenses/Apache-2.0.txt",
        "licenses/BSD-2-Clause.txt",
        "licenses/MIT.txt",
        "licenses/Unicode-3.0.txt",
    ];
    texts(&sysroot.join("share/doc/rust"), &TEXTS)
}

/// Those of what zig links in.
pub(super) fn zig(root: &Path) -> Result<Texts, Error> {
    const TEXTS: [&str; 2] = ["libunwind/LICENSE.TXT", "libc/glibc/LICENSES"];
    let silent = Error::Silent {
        tool: "zig env",
        what: "lib_dir",
    };
    let library = root.join(library(root).ok_or(silent)?);
    let mut all = texts(&library, &TEXTS)?;
    all.extend(texts(library.parent().unwrap_or(&library), &["LICENSE"])?);
    Ok(all)
}

/// zig's folder `lib`, relative to `root` or not. pip calls zig `python-zig`.
fn library(root: &Path) -> Option<String> {
    let env = |zig| said(Command::new(zig).arg("env").current_dir(root));
    let about = env("python-zig").or_else(|| env("zig"))?;
    let line = about.lines().find(|line| line.contains("lib_dir"))?;
    line.rsplit('"').nth(1).map(str::to_owned)
}

fn texts(folder: &Path, names: &[&'static str]) -> Result<Texts, Error> {
    let text = |&name: &&'static str| Ok((name, read(&folder.join(name))?));
    names.iter().map(text).collect()
}

//! The licences of the standard library and of the toolchain.

use std::{path::Path, process::Command};

use spdx::{Expression, LicenseItem, ParseMode};

use crate::{Error, platform::said, share::read};

/// Returns the texts of all licences in `expression`, including alternatives; `None` if one of them
/// is unknown.
#[must_use]
pub fn standard(expression: &str) -> Option<Vec<&'static str>> {
    let parsed = Expression::parse_mode(expression, ParseMode::LAX).ok()?;
    let mut texts = Vec::new();
    for requirement in parsed.requirements() {
        let LicenseItem::Spdx { id, .. } = &requirement.req.license else {
            return None;
        };
        texts.push(id.text());
        if let Some(addition) = &requirement.req.addition {
            texts.push(addition.id()?.text());
        }
    }
    Some(texts)
}

/// Files with their names.
type Texts = Vec<(&'static str, Vec<u8>)>;

/// Returns the licences of Rust's standard library, from the toolchain in `sysroot`.
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

/// Returns the licences of the parts linked by zig.
pub(super) fn zig(root: &Path) -> Result<Texts, Error> {
    const TEXTS: [&str; 2] = ["libunwind/LICENSE.TXT", "libc/glibc/LICENSES"];
    let library = library(root).ok_or_else(|| Error::silent("zig env", "lib_dir"))?;
    let library = root.join(library);
    let mut all = texts(&library, &TEXTS)?;
    all.extend(texts(library.parent().unwrap_or(&library), &["LICENSE"])?);
    Ok(all)
}

/// zig's folder `lib`, absolute or relative to `root`. pip calls zig `python-zig`.
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

//! The tree as a Python wheel: no Python code, only a program and its files.
//!
//! pip installs the `data` of a wheel at the prefix of the environment. So the tree is
//! unpacked unchanged, and the program finds MuJoCo's library in `../lib/ratelab`. Tools
//! that "repair" wheels would move the library elsewhere, and replace the program by a
//! Python script.

use std::io::{Cursor, Write};

use base64::{Engine, engine::general_purpose::URL_SAFE_NO_PAD};
use sha2::{Digest, Sha256};
use zip::{CompressionMethod, DateTime, ZipWriter, result::ZipResult, write::SimpleFileOptions};

use crate::{File, Tree, licences::FOLDER};

/// Metadata of a wheel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wheel {
    /// Version of ratelab.
    pub version: String,
    /// Platform, as named by pip.
    pub platform: String,
    /// Version of the rerun viewer, which the extra `viewer` installs.
    pub viewer: String,
}

impl Wheel {
    /// Returns the name of the file, from which pip reads its compatibility.
    #[must_use]
    pub fn file_name(&self) -> String {
        format!("{}-{}.whl", self.name(), self.tag())
    }

    fn name(&self) -> String {
        format!("ratelab-{}", self.version)
    }

    /// Any Python 3, without any of its interfaces, on one platform.
    fn tag(&self) -> String {
        format!("py3-none-{}", self.platform)
    }

    /// Returns the path of a file of the tree in the wheel.
    fn place(&self, path: &str) -> String {
        let name = self.name();
        if let Some(program) = path.strip_prefix("bin/") {
            return format!("{name}.data/scripts/{program}");
        }
        match path.strip_prefix(FOLDER) {
            Some(licence) => format!("{name}.dist-info/licenses{licence}"),
            None => format!("{name}.data/data/{path}"),
        }
    }

    fn about(&self, licences: &[&str]) -> String {
        let Self {
            version, viewer, ..
        } = self;
        let licences: String = licences
            .iter()
            .map(|file| format!("License-File: {file}\n"))
            .collect();
        format!(
            "Metadata-Version: 2.4\n\
             Name: ratelab\n\
             Version: {version}\n\
             Summary: Robot software as a graph of nodes at fixed rates: a laboratory in the terminal\n\
             License-Expression: MIT OR Apache-2.0\n\
             {licences}\
             Requires-Python: >=3.8\n\
             Provides-Extra: viewer\n\
             Requires-Dist: rerun-sdk=={viewer}; extra == 'viewer'\n\
             Description-Content-Type: text/markdown\n\
             \n\
             The command `ratelab`, with MuJoCo's library. `ratelab` opens the lab,\n\
             `ratelab --help` lists the commands. `ratelab[viewer]` brings the rerun viewer\n\
             for recordings. There is no Python code to import.\n"
        )
    }

    fn format(&self) -> String {
        let tag = self.tag();
        format!(
            "Wheel-Version: 1.0\nGenerator: cargo xtask dist\nRoot-Is-Purelib: false\nTag: {tag}\n"
        )
    }
}

/// Packs `tree` as the wheel that `about` describes.
///
/// # Errors
/// If a path is invalid for a zip file.
pub fn wheel(tree: &Tree, about: &Wheel) -> ZipResult<Vec<u8>> {
    let mut packed = Tree::default();
    for (path, file) in tree.files() {
        packed.insert(about.place(path), file.clone());
    }
    let licences: Vec<_> = tree
        .files()
        .filter_map(|(path, _)| path.strip_prefix(FOLDER))
        .map(|path| path.trim_start_matches('/'))
        .collect();
    let info = format!("{}.dist-info", about.name());
    packed.add(format!("{info}/METADATA"), about.about(&licences));
    packed.add(format!("{info}/WHEEL"), about.format());
    let record = format!("{info}/RECORD");
    packed.add(record.clone(), listing(&packed, &record));
    zipped(&packed)
}

/// Returns the list that pip checks and uses to uninstall: each file with its hash and its size,
/// except for the hash of the list itself.
fn listing(tree: &Tree, itself: &str) -> String {
    let line = |(path, file): (&str, &File)| {
        let hash = URL_SAFE_NO_PAD.encode(Sha256::digest(&file.bytes));
        format!("{path},sha256={hash},{}\n", file.bytes.len())
    };
    let lines: String = tree.files().map(line).collect();
    format!("{lines}{itself},,\n")
}

fn zipped(tree: &Tree) -> ZipResult<Vec<u8>> {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    for (path, file) in tree.files() {
        // The earliest date of a zip file; pip ignores it.
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Deflated)
            .compression_level(Some(9))
            .last_modified_time(DateTime::default())
            .unix_permissions(file.mode());
        archive.start_file(path, options)?;
        archive.write_all(&file.bytes)?;
    }
    Ok(archive.finish()?.into_inner())
}

//! The files of a package, and their tarball.

use std::{collections::BTreeMap, io};

use flate2::{Compression, GzBuilder};
use tar::{Builder, EntryType, Header};

use crate::Error;

/// A file of a package.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct File {
    /// Content of the file.
    pub bytes: Vec<u8>,
    /// Whether it is executable.
    pub is_program: bool,
}

impl File {
    /// Returns its permissions on Unix.
    #[must_use]
    pub fn mode(&self) -> u32 {
        if self.is_program { 0o755 } else { 0o644 }
    }
}

/// Files sorted by path. A path is relative and uses `/`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tree(BTreeMap<String, File>);

impl Tree {
    /// Adds an ordinary file.
    pub fn add(&mut self, path: impl Into<String>, bytes: impl Into<Vec<u8>>) {
        let (bytes, is_program) = (bytes.into(), false);
        self.insert(path, File { bytes, is_program });
    }

    /// Adds an executable file.
    pub fn add_program(&mut self, path: impl Into<String>, bytes: impl Into<Vec<u8>>) {
        let (bytes, is_program) = (bytes.into(), true);
        self.insert(path, File { bytes, is_program });
    }

    /// Adds a file.
    pub(crate) fn insert(&mut self, path: impl Into<String>, file: File) {
        self.0.insert(path.into(), file);
    }

    /// Returns all files, sorted by path.
    pub fn files(&self) -> impl Iterator<Item = (&str, &File)> {
        self.0.iter().map(|(path, file)| (path.as_str(), file))
    }

    /// Checks that no file contains the path of one of `folders`: those of the build
    /// machine are private, and make the bytes differ. Libraries are excluded: they are
    /// unchanged from their makers, whose folders may have the same paths.
    ///
    /// # Errors
    /// With the first such file, and the folder.
    pub fn check_names_none_of(&self, folders: &[String]) -> Result<(), Error> {
        let built_here = |path: &str| !path.starts_with("lib/");
        for (path, file) in self.files().filter(|(path, _)| built_here(path)) {
            if let Some(folder) = folders.iter().find(|folder| names(&file.bytes, folder)) {
                return Err(Error::Unfit(format!(
                    "{path} names {folder}, a folder of this machine: nothing was written"
                )));
            }
        }
        Ok(())
    }
}

/// Returns whether `bytes` contain `folder` as a whole: alone, or as the first folders of a longer
/// path. What stands before it does not matter, because a program keeps its texts without a gap.
fn names(bytes: &[u8], folder: &str) -> bool {
    bytes
        .windows(folder.len())
        .enumerate()
        .filter(|(_, window)| *window == folder.as_bytes())
        .any(|(at, _)| !goes_on(&bytes[at + folder.len()..]))
}

/// Returns whether `rest`, which follows the name of a folder, makes it a longer name, as `_ca`
/// makes `root_ca` of `root`. A full stop does only before more of a name: it may end a sentence.
fn goes_on(rest: &[u8]) -> bool {
    let is_of_name = |byte: &u8| byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'-' | b'+');
    match rest {
        [b'.', next, ..] => is_of_name(next),
        rest => rest.first().is_some_and(is_of_name),
    }
}

/// Packs `tree` below a folder called `name`; each file has the date `time`, in seconds
/// since 1970.
///
/// # Errors
/// If a path is invalid for a tarball.
pub fn tarball(tree: &Tree, name: &str, time: u64) -> io::Result<Vec<u8>> {
    let gzip = GzBuilder::new().write(Vec::new(), Compression::best());
    let mut archive = Builder::new(gzip);
    for (path, file) in tree.files() {
        let path = format!("{name}/{path}");
        archive.append_data(&mut header(file, time), path, &file.bytes[..])?;
    }
    archive.into_inner()?.finish()
}

/// Returns the owner is root, number 0: on unpacking, the current user becomes the owner.
fn header(file: &File, time: u64) -> Header {
    let mut header = Header::new_ustar();
    header.set_entry_type(EntryType::Regular);
    header.set_size(file.bytes.len() as u64);
    header.set_mode(file.mode());
    header.set_mtime(time);
    header.set_uid(0);
    header.set_gid(0);
    header
}

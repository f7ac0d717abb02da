//! The files that are handed out, by their paths.

use std::collections::BTreeMap;

use crate::Error;

/// A file that is handed out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct File {
    /// What is in it.
    pub bytes: Vec<u8>,
    /// Whether it can be run.
    pub is_program: bool,
}

impl File {
    /// Its permissions on Unix.
    #[must_use]
    pub fn mode(&self) -> u32 {
        if self.is_program { 0o755 } else { 0o644 }
    }
}

/// Files by their paths, in the order of these. A path is relative and is written
/// with `/`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tree(BTreeMap<String, File>);

impl Tree {
    /// Adds a file to be read.
    pub fn add(&mut self, path: impl Into<String>, bytes: impl Into<Vec<u8>>) {
        self.insert(path.into(), bytes.into(), false);
    }

    /// Adds a file to be run.
    pub fn add_program(&mut self, path: impl Into<String>, bytes: impl Into<Vec<u8>>) {
        self.insert(path.into(), bytes.into(), true);
    }

    fn insert(&mut self, path: String, bytes: Vec<u8>, is_program: bool) {
        self.0.insert(path, File { bytes, is_program });
    }

    /// All files, sorted by path.
    pub fn files(&self) -> impl Iterator<Item = (&str, &File)> {
        self.0.iter().map(|(path, file)| (path.as_str(), file))
    }

    /// Checks that no file names one of `folders`: those of the machine that built
    /// it are nobody else's business, and make the bytes differ. Libraries are left
    /// out: they are as their makers built them, whose folders may have such names.
    ///
    /// # Errors
    /// Names the first file that does, and the folder.
    pub fn check_names_none_of(&self, folders: &[String]) -> Result<(), Error> {
        let built_here = |path: &str| !path.starts_with("lib/");
        for (path, file) in self.files().filter(|(path, _)| built_here(path)) {
            if let Some(folder) = folders.iter().find(|folder| names(&file.bytes, folder)) {
                return Err(Error::NamesFolder {
                    file: path.to_owned(),
                    folder: folder.clone(),
                });
            }
        }
        Ok(())
    }
}

/// Whether `folder` is in `bytes`, with something below it or as a whole word.
fn names(bytes: &[u8], folder: &str) -> bool {
    let ends = |rest: &[u8]| !rest.first().is_some_and(|b| b.is_ascii_alphanumeric());
    let found = bytes.windows(folder.len()).enumerate();
    let mut found = found.filter(|(_, window)| *window == folder.as_bytes());
    found.any(|(at, _)| ends(&bytes[at + folder.len()..]))
}

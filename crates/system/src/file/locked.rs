//! A text file that several programs change, one at a time.

use std::{
    fs::{self, File},
    io::{self, Write},
    path::Path,
};

use super::{
    TextError,
    paths::{folder_of, has_other_names, resolved},
    read::read_text_if_there,
    unfinished::{Unfinished, check_writable},
};

/// A text file, or none yet, which no other program changes in this way meanwhile.
pub struct LockedFile {
    /// Its text; `None` if there is no file yet.
    pub text: Option<String>,
    new: Unfinished,
    /// The lock is on the folder: the file itself is another one after each change. The
    /// operating system releases it when this is closed.
    _folder: File,
}

impl LockedFile {
    /// Waits for other programs, and locks the file at `path`, of up to `most` bytes. Creates
    /// missing folders.
    ///
    /// # Errors
    /// [`TextError`] for a file that is not a text, is read-only or has several names (hard links),
    /// and for a folder that cannot be written to.
    pub fn lock(path: &Path, most: u64) -> Result<Self, TextError> {
        fs::create_dir_all(folder_of(path))?;
        let target = resolved(path)?;
        let folder = File::open(folder_of(&target))?;
        // On a file system without locks nobody waits.
        let _ = folder.lock();
        let text = read_text_if_there(&target, most)?;
        check_writable(&target)?;
        if has_other_names(&target) {
            let why = "this file has several names (hard links), and a new version would have one";
            return Err(io::Error::other(why).into());
        }
        Ok(Self {
            text,
            new: Unfinished::create(&target)?,
            _folder: folder,
        })
    }

    /// Replaces its text.
    ///
    /// # Errors
    /// The error of the operating system; the file is then as it was.
    pub fn replace(self, text: &str) -> io::Result<()> {
        self.new.writer()?.write_all(text.as_bytes())?;
        self.new.complete()
    }
}

//! A file of results, the one way in which any command writes one.

use std::{
    fs,
    io::{self, Write},
    path::{Path, PathBuf},
};

use ratelab_system::file::{Unfinished, check_writable, has_other_names, is_same, resolved};

use super::{
    kind::OutputKind,
    live::{Live, must_be_live},
    pipe::PatientFile,
    print::write_error,
};
use crate::error::Error;

/// A file of results: a regular file is replaced when it is complete; pipes, devices, files with
/// several names (hard links) and files in read-only folders are written into.
pub struct OutputFile {
    path: PathBuf,
    target: Target,
}

enum Target {
    Whole(Unfinished),
    Live(Live),
}

impl OutputFile {
    /// Opens the file at `path`, which `option` named, without changing its content.
    ///
    /// # Errors
    /// [`Error::BadInput`] if it is not writable.
    pub fn open(option: &str, path: &Path) -> Result<Self, Error> {
        Self::at(path).map_err(|why| Error::unwritable(option, path, &why))
    }

    /// Opens the file at `path` without changing its content.
    ///
    /// # Errors
    /// The error of the operating system.
    pub fn at(path: &Path) -> io::Result<Self> {
        let (target, path) = (Target::to(path)?, path.to_owned());
        Ok(Self { path, target })
    }

    /// Returns the file to write to, emptied.
    ///
    /// # Errors
    /// [`Error::Write`] with the error of the operating system.
    pub fn begin(&mut self) -> Result<PatientFile, Error> {
        let file = match &mut self.target {
            Target::Whole(file) => file.writer().map(PatientFile),
            Target::Live(file) => file.begin(),
        };
        file.map_err(|why| write_error(&self.path, why))
    }

    /// Gives the file its final name if everything was `written`.
    ///
    /// # Errors
    /// [`Error::Write`] with the cause.
    pub fn complete<T>(self, written: io::Result<T>) -> Result<T, Error> {
        let named = written.and_then(|written| match self.target {
            Target::Whole(file) => file.complete().map(|()| written),
            Target::Live(_) => Ok(written),
        });
        named.map_err(|why| write_error(&self.path, why))
    }

    /// Writes all of the file.
    ///
    /// # Errors
    /// [`Error::Write`] with the cause.
    pub fn write(mut self, bytes: &[u8]) -> Result<(), Error> {
        let written = self.begin()?.write_all(bytes);
        self.complete(written)
    }
}

impl Target {
    fn to(path: &Path) -> io::Result<Self> {
        if must_be_live(path) {
            return Live::open(path).map(Self::Live);
        }
        let target = resolved(path)?;
        check_writable(&target)?;
        if has_other_names(&target) {
            return Live::open(&target).map(Self::Live);
        }
        match Unfinished::create(&target) {
            Err(why) if target.exists() && why.kind() == io::ErrorKind::PermissionDenied => {
                Live::open(&target).map(Self::Live)
            }
            created => created.map(Self::Whole),
        }
    }
}

impl OutputKind<'_> {
    /// Opens the file at `path`, which `option` named, to replace one of this kind only.
    ///
    /// # Errors
    /// [`Error::BadInput`] if nothing can be written there, or there is another file.
    pub fn open(self, option: &str, path: &Path) -> Result<OutputFile, Error> {
        self.check(option, path)?;
        OutputFile::open(option, path)
    }

    /// Writes `bytes` to that file. It is none of the files that are `read`.
    ///
    /// # Errors
    /// As of [`open`](Self::open), and [`Error::Write`] with what went wrong.
    pub fn write(
        self,
        option: &str,
        path: &Path,
        read: &[PathBuf],
        bytes: &[u8],
    ) -> Result<(), Error> {
        if read.iter().any(|read| is_same(path, read)) {
            return Err(Error::BadInput(format!(
                "{option} {}: this is the file that is read: choose another name",
                path.display()
            )));
        }
        self.open(option, path)?.write(bytes)
    }
}

/// Refuses an existing file at `path`, which `option` named; a broken link counts as a file.
///
/// # Errors
/// [`Error::BadInput`] if the file exists.
pub fn refuse_existing(option: &str, path: &Path) -> Result<(), Error> {
    if fs::symlink_metadata(path).is_err() {
        return Ok(());
    }
    Err(Error::BadInput(format!(
        "{option} {}: there is such a file: choose another name",
        path.display()
    )))
}

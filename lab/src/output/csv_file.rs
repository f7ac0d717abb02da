//! The file of `--csv`.

use std::{
    fs::File,
    io,
    path::{Path, PathBuf},
};

use super::{
    live::{Live, must_be_live},
    paths::resolved,
    print::write_error,
    unfinished::Unfinished,
};
use crate::error::Error;

/// A file for rows, which replaces an existing file only when it is complete. Pipes,
/// devices and files in read-only folders are written directly.
pub struct CsvFile {
    path: PathBuf,
    way: CsvTarget,
}

enum CsvTarget {
    Whole(Unfinished),
    Live(Live),
}

impl CsvFile {
    /// Opens the file at `path` without changing its content.
    ///
    /// # Errors
    /// [`Error::BadInput`] if it is not writable.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let way = CsvTarget::to(path).map_err(|why| Error::unwritable("--csv", path, &why))?;
        let path = path.to_owned();
        Ok(Self { path, way })
    }

    /// Returns the file to write to, emptied.
    ///
    /// # Errors
    /// [`Error::Write`] with the error of the operating system.
    pub fn begin(&mut self) -> Result<File, Error> {
        let file = match &mut self.way {
            CsvTarget::Whole(file) => file.writer(),
            CsvTarget::Live(file) => file.begin(),
        };
        file.map_err(|why| write_error(&self.path, why))
    }

    /// Gives the file its final name if everything was `written`.
    ///
    /// # Errors
    /// [`Error::Write`] with the cause.
    pub fn complete<T>(self, written: io::Result<T>) -> Result<T, Error> {
        let named = written.and_then(|written| match self.way {
            CsvTarget::Whole(file) => file.complete().map(|()| written),
            CsvTarget::Live(_) => Ok(written),
        });
        named.map_err(|why| write_error(&self.path, why))
    }
}

impl CsvTarget {
    fn to(path: &Path) -> io::Result<Self> {
        if must_be_live(path) {
            return Live::open(path).map(Self::Live);
        }
        let target = resolved(path)?;
        let is_there = target.exists();
        if is_there {
            // A read-only file must not be replaced either.
            File::options().write(true).open(&target)?;
        }
        match Unfinished::create(&target) {
            Err(why) if is_there && why.kind() == io::ErrorKind::PermissionDenied => {
                Live::open(&target).map(Self::Live)
            }
            created => created.map(Self::Whole),
        }
    }
}

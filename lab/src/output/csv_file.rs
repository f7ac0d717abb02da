//! The file of `--csv`.

use std::{
    fs::File,
    io::{self, Read},
    path::{Path, PathBuf},
};

use super::{
    live::{Live, must_be_live},
    paths::resolved,
    print::write_error,
    unfinished::Unfinished,
};
use crate::error::Error;

/// A file for rows, which replaces the one of its name when it is whole. Pipes,
/// devices and files in folders that take no new one are written as they grow.
pub struct CsvFile {
    path: PathBuf,
    way: Way,
}

enum Way {
    Whole(Unfinished),
    Live(Live),
}

impl CsvFile {
    /// Opens the file at `path`; what is in it stays for now.
    ///
    /// # Errors
    /// [`Error::BadInput`] if rows cannot be written there.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let way = Way::to(path).map_err(|why| Error::unwritable("--csv", path, &why))?;
        let path = path.to_owned();
        Ok(Self { path, way })
    }

    /// The file to write to, without what was in it.
    ///
    /// # Errors
    /// [`Error::Write`] with the error of the system.
    pub fn begin(&mut self) -> Result<File, Error> {
        let file = match &mut self.way {
            Way::Whole(file) => file.writer(),
            Way::Live(file) => file.begin(),
        };
        file.map_err(|why| write_error(&self.path, why))
    }

    /// Gives the file its name if all was `written`.
    ///
    /// # Errors
    /// [`Error::Write`] with what went wrong.
    pub fn complete<T>(self, written: io::Result<T>) -> Result<T, Error> {
        let named = written.and_then(|written| match self.way {
            Way::Whole(file) => file.complete().map(|()| written),
            Way::Live(_) => Ok(written),
        });
        named.map_err(|why| write_error(&self.path, why))
    }
}

impl Way {
    fn to(path: &Path) -> io::Result<Self> {
        if must_be_live(path) {
            return Live::open(path).map(Self::Live);
        }
        let target = resolved(path)?;
        let is_there = target.exists();
        if is_there {
            // One that is not to be written is not to be replaced either.
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

/// Refuses a file at `path` that holds something else than rows below `header`,
/// or the beginning of that.
pub fn check_rows(path: &Path, header: &str) -> Result<(), Error> {
    if !path.is_file() || must_be_live(path) {
        return Ok(());
    }
    let mut found = Vec::new();
    let read = File::open(path).and_then(|file| {
        let mut beginning = file.take(header.len() as u64);
        beginning.read_to_end(&mut found)
    });
    read.map_err(|why| Error::unwritable("--csv", path, &why))?;
    if header.as_bytes().starts_with(&found) {
        return Ok(());
    }
    Err(Error::BadInput(format!(
        "--csv {}: there is such a file, and it is no CSV of this command: choose another name",
        path.display()
    )))
}

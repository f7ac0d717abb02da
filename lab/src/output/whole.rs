//! A file that is written at one go.

use std::{
    io::Write,
    path::{Path, PathBuf},
};

use super::{
    kind::Kind,
    paths::{is_same, resolved},
    print::write_error,
    unfinished::Unfinished,
};
use crate::error::Error;

/// Writes `bytes` to the file at `path`, which `option` named. It takes its name when
/// it is whole. It is not the file that is `read`, and replaces files of its `kind` only.
///
/// # Errors
/// [`Error::BadInput`] if nothing can be written there, or there is another file,
/// [`Error::Write`] with what went wrong.
pub fn write_whole(
    option: &str,
    path: &Path,
    kind: Kind,
    read: Option<&Path>,
    bytes: &[u8],
) -> Result<(), Error> {
    if let Some(read) = read {
        refuse_same(option, path, read)?;
    }
    kind.check(option, path)?;
    Whole::create(option, path)?.write(bytes)
}

/// Refuses to write to the file at `path`, which `option` named, if it is `read`.
///
/// # Errors
/// [`Error::BadInput`] if it is.
pub fn refuse_same(option: &str, path: &Path, read: &Path) -> Result<(), Error> {
    match is_same(path, read) {
        true => Err(Error::BadInput(format!(
            "{option} {}: this is the file that is read: choose another name",
            path.display()
        ))),
        false => Ok(()),
    }
}

/// A file that takes its name when it is written.
pub struct Whole {
    file: Unfinished,
    path: PathBuf,
}

impl Whole {
    /// Creates the file at `path`, which `option` named.
    ///
    /// # Errors
    /// [`Error::BadInput`] if nothing can be written there.
    pub fn create(option: &str, path: &Path) -> Result<Self, Error> {
        let file = resolved(path).and_then(|target| Unfinished::create(&target));
        let file = file.map_err(|why| Error::unwritable(option, path, &why))?;
        let path = path.to_owned();
        Ok(Self { file, path })
    }

    /// Writes it.
    ///
    /// # Errors
    /// [`Error::Write`] with what went wrong.
    pub fn write(self, bytes: &[u8]) -> Result<(), Error> {
        let written = self.file.writer();
        let written = written.and_then(|mut writer| writer.write_all(bytes));
        let written = written.and_then(|()| self.file.complete());
        written.map_err(|why| write_error(&self.path, why))
    }
}

//! Files that others wrote, read with care.

use std::{
    fs::{self, File},
    io::{self, Read},
    path::Path,
};

use thiserror::Error;

/// A file that is not read.
#[derive(Debug, Error)]
pub enum FileError {
    /// It is something else than a file.
    #[error("found {0}")]
    NoFile(&'static str),
    /// It is longer than what is read (bytes).
    #[error("found {0} bytes")]
    TooLarge(u64),
    /// The system does not let it be read.
    #[error(transparent)]
    Unreadable(#[from] io::Error),
}

/// The content of the file at `path`, of `most` bytes at the most.
///
/// # Errors
/// [`FileError`] if it is longer, no ordinary file or not readable. Pipes and
/// devices are not opened: they may never end, or never begin.
pub fn read(path: &Path, most: u64) -> Result<Vec<u8>, FileError> {
    let about = fs::metadata(path)?;
    if about.is_dir() {
        return Err(FileError::NoFile("a directory"));
    }
    if !about.is_file() {
        return Err(FileError::NoFile("something that is no ordinary file"));
    }
    if about.len() > most {
        return Err(FileError::TooLarge(about.len()));
    }
    let mut content = Vec::with_capacity(usize::try_from(about.len()).unwrap_or(0));
    // It may have grown since.
    File::open(path)?.take(most + 1).read_to_end(&mut content)?;
    match content.len() as u64 {
        length if length > most => Err(FileError::TooLarge(length)),
        _ => Ok(content),
    }
}

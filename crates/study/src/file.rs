//! Bounded reading of untrusted files.

use std::{
    fs::{self, File},
    io::{self, Read},
    path::Path,
};

use thiserror::Error;

/// An error while reading a file.
#[derive(Debug, Error)]
pub enum FileError {
    /// A directory, pipe or device instead of a file.
    #[error("found {0}")]
    NoFile(&'static str),
    /// A file above the limit (bytes).
    #[error("found {0} bytes")]
    TooLarge(u64),
    /// An error of the operating system.
    #[error(transparent)]
    Unreadable(#[from] io::Error),
}

/// Reads the file at `path`, up to `most` bytes.
///
/// # Errors
/// [`FileError`] for a larger, special or unreadable file. Pipes and devices are never
/// opened, because reading them may block or never end.
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
    // The file may have grown since the check.
    File::open(path)?.take(most + 1).read_to_end(&mut content)?;
    match content.len() as u64 {
        length if length > most => Err(FileError::TooLarge(length)),
        _ => Ok(content),
    }
}

/// Reads the text file at `path`, in UTF-8, up to `most` bytes.
///
/// # Errors
/// What was expected and what was found.
pub fn read_text(path: &Path, most: u64) -> Result<String, String> {
    let content = read(path, most).map_err(|error| match error {
        FileError::Unreadable(why) => why.to_string(),
        other => format!("expected a text file of {most} bytes at most, {other}"),
    })?;
    String::from_utf8(content)
        .map_err(|_| "expected a text file in UTF-8, found other bytes".to_owned())
}

//! The one door to files, for reading and for writing.
//!
//! What is read is a regular file of a limited size: a pipe or a device may block, or never end.
//! What is written gets its name when it is complete, with the permissions of the file that it
//! replaces; a link leads to its target.

mod unfinished;

use std::{
    fs::{self, File, FileType},
    io::{self, ErrorKind, Read},
    os::unix::fs::{FileTypeExt, MetadataExt},
    path::{Path, PathBuf, is_separator},
};

use thiserror::Error;

pub use unfinished::{LockedFile, Provisional, Unfinished, check_writable, remove_unfinished};

/// Resolves all links in `path`; the file need not exist yet.
///
/// # Errors
/// If it cannot be a file, or its folder does not exist.
pub fn resolved(path: &Path) -> io::Result<PathBuf> {
    let named_as_folder = path.to_string_lossy().ends_with(is_separator);
    match fs::metadata(path) {
        Ok(about) if about.is_dir() => return Err(io::ErrorKind::IsADirectory.into()),
        _ if named_as_folder => return Err(io::ErrorKind::IsADirectory.into()),
        Err(why) if why.kind() != io::ErrorKind::NotFound => return Err(why),
        _ => {}
    }
    let mut path = path.to_owned();
    while let Ok(target) = fs::read_link(&path) {
        path = folder_of(&path).join(target);
    }
    let name = path.file_name().ok_or(io::ErrorKind::NotFound)?;
    Ok(fs::canonicalize(folder_of(&path))?.join(name))
}

/// Returns the folder that the file at `path` is in.
pub fn folder_of(path: &Path) -> &Path {
    let folder = path.parent().filter(|folder| *folder != Path::new(""));
    folder.unwrap_or(Path::new("."))
}

/// Returns whether both paths lead to one file.
pub fn is_same(one: &Path, other: &Path) -> bool {
    let linked = || {
        let both = one.is_file() && other.is_file();
        both && same_file::is_same_file(one, other).unwrap_or(false)
    };
    match (resolved(one), resolved(other)) {
        (Ok(first), Ok(second)) => first == second || linked(),
        _ => false,
    }
}

/// Returns whether the file at `path` has other names (hard links), which a new file in its place
/// would leave behind.
pub fn has_other_names(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|about| about.is_file() && about.nlink() > 1)
}

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

/// An error while reading a text file.
#[derive(Debug, Error)]
pub enum TextError {
    /// A directory, pipe or device, or a file above the limit.
    #[error("expected a text file of {most} bytes at most, {found}")]
    NoText {
        /// The limit (bytes).
        most: u64,
        /// What is there.
        found: FileError,
    },
    /// A file of other bytes.
    #[error("expected a text file in UTF-8, found other bytes")]
    OtherBytes,
    /// An error of the operating system.
    #[error(transparent)]
    Unreadable(#[from] io::Error),
}

/// Returns what a file is that is not a regular one.
fn kind(of: FileType) -> &'static str {
    if of.is_dir() {
        "a directory"
    } else if of.is_fifo() {
        "a pipe"
    } else if of.is_socket() {
        "a socket"
    } else {
        "a device"
    }
}

/// Reads the file at `path`, up to `most` bytes.
///
/// # Errors
/// [`FileError`] for a larger, special or unreadable file. Pipes and devices are never
/// opened, because reading them may block or never end.
pub fn read(path: &Path, most: u64) -> Result<Vec<u8>, FileError> {
    let about = fs::metadata(path)?;
    if !about.is_file() {
        return Err(FileError::NoFile(kind(about.file_type())));
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
/// [`TextError`] with what was expected and what was found.
pub fn read_text(path: &Path, most: u64) -> Result<String, TextError> {
    let content = read(path, most).map_err(|error| match error {
        FileError::Unreadable(why) => TextError::Unreadable(why),
        found => TextError::NoText { most, found },
    })?;
    String::from_utf8(content).map_err(|_| TextError::OtherBytes)
}

/// Reads a text file as [`read_text`] does; `None` if there is no such file.
///
/// # Errors
/// As there.
pub fn read_text_if_there(path: &Path, most: u64) -> Result<Option<String>, TextError> {
    match read_text(path, most) {
        Err(TextError::Unreadable(why)) if why.kind() == ErrorKind::NotFound => Ok(None),
        read => read.map(Some),
    }
}

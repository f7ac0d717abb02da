//! The one door to files, for reading and for writing.
//!
//! What is read is a regular file of a limited size: a pipe or a device may block, or never end.
//! What is written gets its name when it is complete, with the permissions of the file that it
//! replaces; a link leads to its target.

mod locked;
mod paths;
mod read;
mod unfinished;

pub use locked::LockedFile;
pub use paths::{folder_of, has_other_names, is_same, resolved};
pub use read::{FileError, TextError, read, read_text, read_text_if_there};
pub use unfinished::{Provisional, Unfinished, check_writable, remove_unfinished};

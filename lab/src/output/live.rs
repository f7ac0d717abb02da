//! Files that grow where others see them: pipes, devices, and the rows of the lab.

use std::{
    fs::{self, File},
    io,
    os::fd::AsFd,
    path::{Path, PathBuf},
};

use super::paths::resolved;

/// A file that is open and as it was, until it [begins](Self::begin). Dropped
/// before, one that was new is gone.
pub struct Live {
    file: File,
    /// Whether its content will be replaced.
    replaces: bool,
    /// Where it was made.
    made: Option<PathBuf>,
}

impl Live {
    /// Opens the file at `path`, or makes it.
    ///
    /// # Errors
    /// The error of the system.
    pub fn open(path: &Path) -> io::Result<Self> {
        if let Some(file) = standard_stream(path) {
            return Ok(Self {
                file,
                replaces: false,
                made: None,
            });
        }
        let new = if path.exists() {
            None
        } else {
            Some(resolved(path)?)
        };
        let mut options = File::options();
        let file = options
            .write(true)
            .create(true)
            .truncate(false)
            .open(path)?;
        Ok(Self {
            replaces: file.metadata()?.is_file(),
            made: new,
            file,
        })
    }

    /// The file without what was in it.
    ///
    /// # Errors
    /// The error of the system.
    pub fn begin(&mut self) -> io::Result<File> {
        if self.replaces {
            self.file.set_len(0)?;
        }
        self.made = None;
        self.file.try_clone()
    }
}

impl Drop for Live {
    fn drop(&mut self) {
        if let Some(path) = &self.made {
            let _ = fs::remove_file(path);
        }
    }
}

/// Standard output or standard error, if `path` is the file that it goes to: by
/// a stream of its own, each would write over the other's text.
fn standard_stream(path: &Path) -> Option<File> {
    if !path.is_file() {
        return None;
    }
    let file = same_file::Handle::from_path(path).ok()?;
    let stream = if same_file::Handle::stdout().is_ok_and(|stream| stream == file) {
        io::stdout().as_fd().try_clone_to_owned()
    } else if same_file::Handle::stderr().is_ok_and(|stream| stream == file) {
        io::stderr().as_fd().try_clone_to_owned()
    } else {
        return None;
    };
    stream.map(File::from).ok()
}

/// Whether the file at `path` is written as it grows in any case: a pipe, a device,
/// or where standard output goes.
pub fn must_be_live(path: &Path) -> bool {
    let special = fs::metadata(path).is_ok_and(|about| !about.is_file());
    special || standard_stream(path).is_some()
}

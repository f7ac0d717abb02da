//! Files that are written in place: pipes, devices, and the rows of the lab.

use std::{
    fs::{self, File},
    io,
    os::fd::AsFd,
    path::Path,
};

use ratelab_system::file::{Provisional, check_writable, resolved};

use super::pipe::{self, PatientFile};

/// An open file with unchanged content until [`begin`](Self::begin). If it is dropped
/// before, a new file is removed.
pub struct Live {
    file: File,
    /// Whether its old content is discarded.
    replaces: bool,
    /// A newly created file.
    made: Option<Provisional>,
}

impl Live {
    /// Opens or creates the file at `path`.
    ///
    /// # Errors
    /// The error of the operating system.
    pub fn open(path: &Path) -> io::Result<Self> {
        let open = match standard_stream(path) {
            None if pipe::is_pipe(path) => Some(pipe::open(path)?),
            stream => stream,
        };
        if let Some(file) = open {
            return Ok(Self {
                file,
                replaces: false,
                made: None,
            });
        }
        if !path.exists() {
            let (made, file) = Provisional::new(&resolved(path)?, |path| File::create_new(path))?;
            return Ok(Self {
                file,
                replaces: true,
                made: Some(made),
            });
        }
        check_writable(path)?;
        let file = File::options().write(true).open(path)?;
        Ok(Self {
            replaces: file.metadata()?.is_file(),
            made: None,
            file,
        })
    }

    /// Returns the file, emptied.
    ///
    /// # Errors
    /// The error of the operating system.
    pub fn begin(&mut self) -> io::Result<PatientFile> {
        if self.replaces {
            self.file.set_len(0)?;
        }
        if let Some(made) = self.made.take() {
            made.keep();
        }
        self.file.try_clone().map(PatientFile)
    }
}

/// Standard output or standard error, if it goes to the file at `path`: with two separate
/// streams each would overwrite the other's text.
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

/// Returns whether the file at `path` must be written in place: a pipe, a device, or the target of
/// standard output.
pub fn must_be_live(path: &Path) -> bool {
    let special = fs::metadata(path).is_ok_and(|about| !about.is_file());
    special || standard_stream(path).is_some()
}

//! Files that are written to while a run goes on, and pipes.

use std::{
    fs::{self, File, OpenOptions},
    io::{self, Write},
    os::{
        fd::AsFd,
        unix::fs::{FileTypeExt, OpenOptionsExt},
    },
    path::Path,
    sync::atomic::{AtomicUsize, Ordering},
    thread,
    time::{Duration, Instant},
};

use ratelab_system::file::{Provisional, check_writable, resolved};
use rustix::{fs::OFlags, io::Errno};

use super::print::note;
use crate::signals;

/// Time between two attempts.
const PAUSE: Duration = Duration::from_millis(10);

/// Longest wait for a reader that is not told.
const SOON: Duration = Duration::from_secs(1);

/// Longest wait for a reader after a signal.
const GRACE: Duration = Duration::from_millis(500);

/// Number of threads that wait for a reader.
static WAITING: AtomicUsize = AtomicUsize::new(0);

/// Returns whether a command waits for the reader of a pipe: a signal ends the wait, with an error.
pub fn waits_for_reader() -> bool {
    WAITING.load(Ordering::SeqCst) > 0
}

/// The wait for a reader, until it is dropped.
struct ReaderWait;

impl ReaderWait {
    fn new() -> Self {
        WAITING.fetch_add(1, Ordering::SeqCst);
        Self
    }
}

impl Drop for ReaderWait {
    fn drop(&mut self) {
        WAITING.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Returns whether the file at `path` is a named pipe.
pub fn is_pipe(path: &Path) -> bool {
    path.metadata()
        .is_ok_and(|about| about.file_type().is_fifo())
}

/// Opens the named pipe at `path` for writing, once it has a reader. A wait that a person would see
/// is told.
///
/// # Errors
/// The error of the operating system, and a signal during the wait.
pub fn open(path: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options
        .write(true)
        .custom_flags(OFlags::NONBLOCK.bits().cast_signed());
    let _wait = ReaderWait::new();
    let (began, mut told) = (Instant::now(), false);
    loop {
        match options.open(path) {
            Err(why) if Errno::from_io_error(&why) == Some(Errno::NXIO) => {
                if !told && began.elapsed() > SOON {
                    let shown = path.display();
                    note(&format!(
                        "{shown}: nobody reads this pipe: waiting for a reader"
                    ));
                    told = true;
                }
                wait("nobody reads this pipe", Duration::ZERO)?;
            }
            opened => return opened,
        }
    }
}

/// A file for writing. Where that is a pipe, it waits for its reader, but not after a
/// signal.
#[derive(Debug)]
pub struct PatientFile(pub File);

impl Write for PatientFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let began = Instant::now();
        let _wait = ReaderWait::new();
        loop {
            match self.0.write(bytes) {
                Err(why) if why.kind() == io::ErrorKind::WouldBlock => {
                    wait("the reader of this pipe has stopped", began.elapsed())?;
                }
                written => return written,
            }
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

/// Waits a moment, after `waited` so far; the error after a signal gives the reason.
fn wait(why: &str, waited: Duration) -> io::Result<()> {
    let patient = waited < GRACE && !waited.is_zero();
    if signals::exit_code().is_some() && !patient {
        return Err(io::Error::other(format!(
            "{why}, and a signal ended the wait"
        )));
    }
    thread::sleep(PAUSE);
    Ok(())
}

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
            None if is_pipe(path) => Some(open(path)?),
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

//! Named pipes, whose readers may be slow or absent: no signal waits for them.

use std::{
    fs::{File, OpenOptions},
    io::{self, Write},
    os::unix::fs::{FileTypeExt, OpenOptionsExt},
    path::Path,
    thread,
    time::{Duration, Instant},
};

use rustix::{fs::OFlags, io::Errno};

use crate::stop_signal;

/// Time between two attempts.
const PAUSE: Duration = Duration::from_millis(10);

/// Longest wait for a reader after a signal.
const GRACE: Duration = Duration::from_millis(500);

/// Whether the file at `path` is a named pipe.
pub fn is_pipe(path: &Path) -> bool {
    path.metadata()
        .is_ok_and(|about| about.file_type().is_fifo())
}

/// Opens the named pipe at `path` for writing, once it has a reader.
///
/// # Errors
/// The error of the operating system, and a signal during the wait.
pub fn open(path: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options
        .write(true)
        .custom_flags(OFlags::NONBLOCK.bits().cast_signed());
    loop {
        match options.open(path) {
            Err(why) if Errno::from_io_error(&why) == Some(Errno::NXIO) => {
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
    if stop_signal::exit_code().is_some() && !patient {
        return Err(io::Error::other(format!(
            "{why}, and a signal ended the wait"
        )));
    }
    thread::sleep(PAUSE);
    Ok(())
}

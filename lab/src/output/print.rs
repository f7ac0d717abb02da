//! Printing, and errors of writing.

use std::{
    fmt,
    io::{self, IsTerminal, Write},
    os::fd::AsFd,
    path::Path,
};

use rustix::{
    fs::{FileType, fstat},
    io::Errno,
};
use serde::Serialize;

use crate::{
    error::Error,
    summary::text,
    wrap::{fitted, room},
};
use ratelab_recording::printable::{in_coloured_lines, in_lines, one_line};
use ratelab_recording::{FinishedRecording, RecordError};

/// Prints lines for people to standard output, made safe for a terminal and wrapped to its
/// width; it is not an error that the reader has closed it.
pub fn print_line(text: &str) -> Result<(), Error> {
    print_fitted(&in_lines(text))
}

/// Prints lines as [`print_line`] does, with the colours in them.
pub fn print_coloured(text: &str) -> Result<(), Error> {
    print_fitted(&in_coloured_lines(text))
}

fn print_fitted(text: &str) -> Result<(), Error> {
    let text = fitted(text, room(&io::stdout()));
    printed(writeln!(io::stdout(), "{text}"))
}

/// Prints the text before a place for an answer, in the same line.
pub fn prompt(text: &str) -> Result<(), Error> {
    let mut stdout = io::stdout();
    printed(write!(stdout, "{}", in_lines(text)).and_then(|()| stdout.flush()))
}

/// Prints lines for programs to standard output: as [`print_line`] does, but with each line
/// as long as it is.
pub fn print_data(text: &str) -> Result<(), Error> {
    printed(writeln!(io::stdout(), "{}", in_lines(text)))
}

/// Prints a result: for programs with `--json`, and otherwise for people.
pub fn print_result(json: bool, report: &impl Serialize, text: &str) -> Result<(), Error> {
    if json {
        // By way of a value, which sorts the keys.
        let data = serde_json::to_value(report);
        let data = data.map_err(|why| write_error(Path::new("the result"), why.into()))?;
        print_data(&format!("{data:#}"))
    } else {
        print_line(text)
    }
}

/// Turns the result of printing to standard output into a result of the command.
pub fn printed(outcome: io::Result<()>) -> Result<(), Error> {
    match outcome {
        Err(why) if !is_closed(&why) => Err(write_error(Path::new("to standard output"), why)),
        _ => Ok(()),
    }
}

/// Returns whether the reader of standard output is gone: the next program of a pipeline, or the
/// terminal.
fn is_closed(why: &io::Error) -> bool {
    let is_device = || {
        let about = fstat(io::stdout().as_fd());
        about.is_ok_and(|of| FileType::from_raw_mode(of.st_mode) == FileType::CharacterDevice)
    };
    let is_gone = Errno::from_io_error(why) == Some(Errno::IO);
    why.kind() == io::ErrorKind::BrokenPipe || (is_gone && is_device())
}

/// Prints an error.
pub fn error(error: &impl fmt::Display) {
    aside(&format!("error: {error}"));
}

/// Prints that the signal called `name` ended the command, below what the terminal shows of a key.
pub fn stopped_by(name: &str) {
    let mut stderr = io::stderr();
    if stderr.is_terminal() {
        let _ = writeln!(stderr); // As in `aside`.
    }
    error(&format!("stopped by {name}"));
}

/// Prints a note, which is not an error.
pub fn note(text: &str) {
    aside(&format!("note: {text}"));
}

/// Prints one line to standard error, made safe for a terminal and wrapped to its width.
fn aside(text: &str) {
    let text = fitted(&one_line(text), room(&io::stderr()));
    // Without standard error the text is lost.
    let _ = writeln!(io::stderr(), "{text}");
}

/// Prints the path of a recording: to standard error with `--json`, where standard output
/// contains metrics only.
pub fn print_recorded(json: bool, recorded: &FinishedRecording) -> Result<(), Error> {
    let line = text::recorded(recorded);
    if json {
        aside(&line);
        Ok(())
    } else {
        print_line(&line)
    }
}

/// Returns an error when a recording cannot begin.
pub fn record_error(RecordError { path, why }: RecordError) -> Error {
    match why.kind() {
        io::ErrorKind::AlreadyExists if path.symlink_metadata().is_ok() => {
            Error::BadInput(format!(
                "--record {}: there is such a file, and recordings overwrite none: \
             choose another name",
                path.display()
            ))
        }
        _ => Error::unwritable("--record", &path, &why),
    }
}

/// Returns an error when a file cannot be written.
pub fn write_error(path: &Path, why: io::Error) -> Error {
    let what = path.display().to_string();
    Error::Write { what, why }
}

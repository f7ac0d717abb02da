//! Printing, and errors of writing.

use std::{
    fmt,
    io::{self, Write},
    path::Path,
};

use serde_json::Value;

use crate::{
    error::Error,
    printable::{in_lines, one_line},
    summary::text,
    wrap::{fitted, room},
};
use ratelab_recording::{FinishedRecording, RecordError};

/// Prints lines for people to standard output, made safe for a terminal and wrapped to its
/// width; a reader that has closed it is no error.
pub fn print_line(text: &str) -> Result<(), Error> {
    let text = fitted(&in_lines(text), room(&io::stdout()));
    printed(writeln!(io::stdout(), "{text}"))
}

/// Prints lines for programs to standard output: as [`print_line`] does, but with each line
/// as long as it is.
pub fn print_data(text: &str) -> Result<(), Error> {
    printed(writeln!(io::stdout(), "{}", in_lines(text)))
}

/// Prints a result: for programs with `--json`, and otherwise for people.
pub fn print_result(json: bool, data: &Value, text: &str) -> Result<(), Error> {
    match json {
        true => print_data(&format!("{data:#}")),
        false => print_line(text),
    }
}

/// Turns the result of printing to standard output into a result of the command.
pub fn printed(outcome: io::Result<()>) -> Result<(), Error> {
    match outcome {
        Err(why) if why.kind() != io::ErrorKind::BrokenPipe => {
            Err(write_error(Path::new("to standard output"), why))
        }
        _ => Ok(()),
    }
}

/// Prints an error.
pub fn error(error: &impl fmt::Display) {
    aside(&format!("error: {error}"));
}

/// Prints a note that is no error.
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

/// An error when a recording cannot begin.
pub fn record_error(RecordError { path, why }: RecordError) -> Error {
    match why.kind() {
        io::ErrorKind::AlreadyExists if path.exists() => Error::BadInput(format!(
            "--record {}: there is such a file, and recordings overwrite none: \
             choose another name",
            path.display()
        )),
        _ => Error::unwritable("--record", &path, &why),
    }
}

/// An error when a file cannot be written.
pub fn write_error(path: &Path, why: io::Error) -> Error {
    let what = path.display().to_string();
    Error::Write { what, why }
}

//! Printing, errors of writing, and a progress bar on standard error.

use std::{
    fmt,
    io::{self, IsTerminal, Write, stderr},
    os::fd::AsFd,
    path::Path,
};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use ratelab_recording::{
    FinishedRecording, RecordError,
    printable::{in_coloured_lines, in_lines, one_line},
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

/// The line for a share of something.
const SHARE: &str = "{wide_bar} {percent} % of {msg}  {eta} left";

/// The line for a number of runs.
const RUNS: &str = "{wide_bar} {human_pos} of {human_len} runs  {rate} runs/s  {eta} left";

/// A line with a bar, drawn at most ten times per second, which ends when it is dropped; hidden
/// without a terminal.
pub struct ProgressLine(ProgressBar);

impl ProgressLine {
    /// Creates a bar of this `length`, which is that of `what`.
    pub fn new(length: u64, what: String) -> Self {
        Self(bar(length, SHARE).with_message(what))
    }

    /// Creates a bar for so many `runs`, drawn with ASCII characters only if `ascii`; hidden if
    /// `quiet`.
    pub fn for_runs(runs: usize, ascii: bool, quiet: bool) -> Self {
        if quiet {
            return Self(ProgressBar::hidden());
        }
        let rate = |state: &ProgressState, out: &mut dyn fmt::Write| {
            let _ = write!(out, "{:.0}", state.per_sec()); // The next drawing tries again.
        };
        // The finished part, the next position, and the rest.
        let glyphs = if ascii { "#>-" } else { "█▌░" };
        let bar = bar(runs as u64, RUNS);
        let style = bar.style().progress_chars(glyphs).with_key("rate", rate);
        Self(bar.with_style(style))
    }

    /// Moves on to `position`.
    pub fn set(&self, position: u64) {
        self.0.set_position(position);
    }

    /// Returns whether nobody sees it.
    pub fn is_hidden(&self) -> bool {
        self.0.is_hidden()
    }

    /// Moves on by one.
    pub fn advance(&self) {
        self.0.inc(1);
    }
}

fn bar(length: u64, template: &str) -> ProgressBar {
    if !stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let target = ProgressDrawTarget::stderr_with_hz(10);
    let style =
        ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::with_draw_target(Some(length), target).with_style(style)
}

impl Drop for ProgressLine {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

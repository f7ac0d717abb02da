//! A row with commas in between for each control step of a run.

use std::{
    io::{self, BufWriter, Write},
    thread::{self, JoinHandle},
};

use ratelab::Time;
use ratelab_account::RowTap;

use super::Experiment;
use crate::system::{StateTable, names::key};

/// Number of control steps that may wait to be written before a real clock, which never
/// waits, loses rows: minutes at 50 Hz.
const BACKLOG: usize = 16_384;

/// The first line of a table of `experiment`; `None` if its system has no states.
pub fn header(experiment: &Experiment) -> Option<String> {
    let system = experiment.system();
    let state = system.state()?;
    if let Some(table) = system.about().table {
        return Some(table.header.to_owned());
    }
    let taps = experiment.taps();
    let topic = taps.topic(state)?;
    let fields = topic.fields().iter().map(|field| key(field));
    Some(line("time_s", fields))
}

/// Writes the control steps of an experiment on a separate thread.
pub struct StepWriter(JoinHandle<io::Result<u64>>);

impl StepWriter {
    /// Writes to `file` from the first step of `experiment` to its last. If the file
    /// could not be opened, no rows are written and [`finish`](Self::finish) returns the
    /// error.
    pub fn start(file: io::Result<impl Write + Send + 'static>, experiment: &Experiment) -> Self {
        let header = header(experiment).unwrap_or_default();
        let state = experiment.system().state();
        let tap = state.and_then(|state| experiment.taps().rows(state, BACKLOG));
        let table = experiment.system().about().table;
        Self(thread::spawn(move || {
            let mut out = BufWriter::new(file?);
            writeln!(out, "{header}")?;
            let lost = tap.map_or(Ok(0), |tap| write(&mut out, &tap, table));
            out.flush().and(lost)
        }))
    }

    /// Waits for the end of the experiment and of the writing; returns the number of lost
    /// rows.
    ///
    /// # Errors
    /// The error of opening the file, or of writing to it.
    pub fn finish(self) -> io::Result<u64> {
        let written = self.0.join();
        written.unwrap_or_else(|_| Err(io::Error::other("the writer panicked")))
    }
}

/// Writes rows until the tap ends; returns the number of lost ones.
fn write(out: &mut impl Write, tap: &RowTap, table: Option<StateTable>) -> io::Result<u64> {
    let row = table.map_or(plain as fn(Time, &[f64]) -> String, |table| table.row);
    let mut rows = tap.rows();
    while tap.wait(&mut rows) {
        for (head, values) in rows.iter() {
            writeln!(out, "{}", row(head.at, values))?;
        }
        rows.clear();
        out.flush()?; // So that `tail -f` shows the current run.
    }
    Ok(tap.lost())
}

/// Run time and the numbers; NaN and infinity give empty fields.
fn plain(at: Time, row: &[f64]) -> String {
    let values = row.iter().map(|value| match value {
        value if value.is_nan() => String::new(),
        value => value.to_string(),
    });
    line(at.as_secs_f64(), values)
}

/// A line of the table.
fn line(time: impl ToString, cells: impl Iterator<Item = String>) -> String {
    cells.fold(time.to_string(), |line, cell| line + "," + &cell)
}

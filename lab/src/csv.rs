//! One row per control step.

use std::{
    fs::File,
    io::{self, BufWriter, Write},
    thread::{self, JoinHandle},
};

use ratelab::{
    experiment::Experiment,
    runtime::{RowTap, Time},
    system::Table,
};

use crate::names::key;

/// Control steps that may wait to be written before rows are lost to a real
/// clock, which does not wait: minutes at 50 Hz.
const BACKLOG: usize = 16_384;

/// The first line of a table of `experiment`; `None` if its system has no states.
pub fn header(experiment: &Experiment) -> Option<String> {
    let system = experiment.system();
    let state = system.state()?;
    if let Some(table) = system.table() {
        return Some(table.header.to_owned());
    }
    let taps = experiment.taps();
    let topic = taps.topics().iter().find(|topic| topic.name() == state)?;
    let fields = topic.fields().iter().map(|field| key(field));
    Some(
        ["time_s".to_owned()]
            .into_iter()
            .chain(fields)
            .collect::<Vec<_>>()
            .join(","),
    )
}

/// Writes the control steps of an experiment on a thread of its own.
pub struct StepWriter(JoinHandle<io::Result<u64>>);

impl StepWriter {
    /// Writes to `file` from the first step of `experiment` to its last. A file that
    /// could not be opened is an error at the end, and no rows.
    pub fn start(file: io::Result<File>, experiment: &Experiment) -> Self {
        let header = header(experiment).unwrap_or_default();
        let state = experiment.system().state();
        let tap = state.and_then(|state| experiment.taps().rows(state, BACKLOG));
        let table = experiment.system().table();
        Self(thread::spawn(move || {
            let mut out = BufWriter::new(file?);
            writeln!(out, "{header}")?;
            let lost = tap.map_or(Ok(0), |tap| write(&mut out, &tap, table));
            out.flush().and(lost)
        }))
    }

    /// Waits until all is written, which takes the end of the experiment; returns
    /// how many rows were lost.
    pub fn finish(self) -> io::Result<u64> {
        let written = self.0.join();
        written.unwrap_or_else(|_| Err(io::Error::other("the writer panicked")))
    }
}

/// Writes rows as long as the tap gives any; returns how many it lost.
fn write(out: &mut impl Write, tap: &RowTap, table: Option<Table>) -> io::Result<u64> {
    let row = table.map_or(plain as fn(Time, &[f64]) -> String, |table| table.row);
    let mut rows = tap.rows();
    while tap.wait(&mut rows) {
        for (head, values) in rows.iter() {
            writeln!(out, "{}", row(head.stamp, values))?;
        }
        rows.clear();
        out.flush()?; // Whoever follows the file sees the run as it is.
    }
    Ok(tap.lost())
}

/// Run time and the numbers; what is not a number is empty.
fn plain(at: Time, row: &[f64]) -> String {
    let values = row.iter().map(|value| match value {
        value if value.is_nan() => String::new(),
        value => value.to_string(),
    });
    let row: Vec<String> = [at.as_secs_f64().to_string()]
        .into_iter()
        .chain(values)
        .collect();
    row.join(",")
}

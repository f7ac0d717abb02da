//! A row with commas in between for each control step of a run.

use std::{
    io::{self, BufWriter, Write},
    thread::{self, JoinHandle},
};

use ratelab::{Head, Time};
use ratelab_metrics::{RunRow, Tap};

use super::Experiment;
use ratelab_system::{StateTable, names::key};

/// Number of messages and ticks that may wait to be written before a real clock, which never
/// waits, loses some: minutes at 50 Hz.
const BACKLOG: usize = 65_536;

/// Writes the control steps of an experiment on a separate thread.
pub struct StepWriter(JoinHandle<io::Result<u64>>);

impl StepWriter {
    /// Returns the first columns of a table of `experiment`, by which its file is known; `None` if its
    /// system has no states.
    pub fn header(experiment: &Experiment) -> Option<String> {
        let system = experiment.system();
        let state = system.states_topic()?;
        if let Some(table) = system.robot().table() {
            return Some(table.header.to_owned());
        }
        let taps = experiment.taps();
        let topic = taps.topic(state)?;
        let fields = topic.fields().iter().map(|field| key(field));
        Some(line("time_s", fields))
    }

    /// Writes to `file` from the first step of `experiment` to its last. If the file
    /// could not be opened, no rows are written and [`finish`](Self::finish) returns the
    /// error.
    pub fn start(file: io::Result<impl Write + Send + 'static>, experiment: &Experiment) -> Self {
        let table = StepTable::new(experiment);
        let tap = experiment.taps().all(BACKLOG);
        Self(thread::spawn(move || {
            let mut out = BufWriter::new(file?);
            let lost = table.map_or(Ok(0), |table| table.write(&mut out, &tap));
            out.flush().and(lost)
        }))
    }

    /// Waits for the end of the experiment and of the writing; returns the number of lost
    /// messages and ticks.
    ///
    /// # Errors
    /// The error of opening the file, or of writing to it.
    pub fn finish(self) -> io::Result<u64> {
        let written = self.0.join();
        written.unwrap_or_else(|_| Err(io::Error::other("the writer panicked")))
    }
}

/// The table while it is written.
struct StepTable {
    header: String,
    /// The index of the topic of the states.
    state: usize,
    table: Option<StateTable>,
    /// The topics with readers, by their indices, with what each lost unread so far.
    dropped: Vec<(usize, u64)>,
    /// The sensing behind the newest push.
    sensed: Option<Time>,
}

impl StepTable {
    /// Creates the empty table of `experiment`; `None` if its system has no states.
    fn new(experiment: &Experiment) -> Option<Self> {
        let (system, taps) = (experiment.system(), experiment.taps());
        let topology = experiment.observer().topology();
        let is_read = |name: &str| {
            let topic = topology.topics.iter().find(|topic| topic.name == name);
            topic.is_some_and(|topic| !topic.readers.is_empty())
        };
        let read: Vec<&str> = taps
            .topics()
            .iter()
            .map(|topic| topic.name())
            .filter(|name| is_read(name))
            .collect();
        let table = system.robot().table();
        let names = read.iter().map(|name| format!("{}_dropped", key(name)));
        let more = table.map(|table| table.more.to_owned());
        let more = ["push_age_ms".to_owned()]
            .into_iter()
            .chain(names)
            .chain(more);
        let dropped = read
            .iter()
            .filter_map(|name| Some((topology.topic(name)?, 0)));
        Some(Self {
            header: line(StepWriter::header(experiment)?, more),
            state: topology.topic(system.states_topic()?)?,
            table,
            dropped: dropped.collect(),
            sensed: None,
        })
    }

    /// Writes rows until the tap ends; returns the number of lost messages and ticks.
    fn write(mut self, out: &mut impl Write, tap: &Tap<RunRow>) -> io::Result<u64> {
        writeln!(out, "{}", self.header)?;
        for row in tap.items() {
            if let Some(row) = self.row(&row) {
                writeln!(out, "{row}")?;
            }
            if tap.items().is_empty() {
                out.flush()?; // So that `tail -f` shows the current run.
            }
        }
        Ok(tap.lost())
    }

    /// Returns the line of the table that `row` of the run makes, if it is a state.
    fn row(&mut self, row: &RunRow) -> Option<String> {
        match row {
            RunRow::Tick(_, tick) => {
                self.sensed = tick.push.map(|push| push.sensed).or(self.sensed);
                None
            }
            RunRow::Message(topic, head, numbers) => {
                let mut dropped = self.dropped.iter_mut();
                if let Some((_, dropped)) = dropped.find(|(of, _)| of == topic) {
                    *dropped = head.dropped;
                }
                (*topic == self.state).then(|| self.line(head, numbers))
            }
        }
    }

    /// Returns the line of a state.
    fn line(&self, head: &Head, numbers: &[f64]) -> String {
        let row = self
            .table
            .map_or(plain as fn(_, &_) -> _, |table| table.row);
        // A state that comes of a push says of which one; its tick is over later.
        let age = head.origin.or(self.sensed).map(|sensed| {
            let age = head.at.since(sensed).as_nanos() as f64 / 1e6;
            age.to_string()
        });
        let dropped = self.dropped.iter().map(|(_, dropped)| dropped.to_string());
        let more = self.table.map(|table| (table.more_cells)(numbers));
        let age = [age.unwrap_or_default()].into_iter();
        line(row(head.at, numbers), age.chain(dropped).chain(more))
    }
}

/// Returns the run time and the numbers; NaN and infinity give empty fields.
fn plain(at: Time, row: &[f64]) -> String {
    let values = row.iter().map(|value| match value {
        value if value.is_nan() => String::new(),
        value => value.to_string(),
    });
    line(at.as_secs_f64(), values)
}

/// Returns a line of the table.
fn line(first: impl ToString, cells: impl Iterator<Item = String>) -> String {
    cells.fold(first.to_string(), |line, cell| line + "," + &cell)
}

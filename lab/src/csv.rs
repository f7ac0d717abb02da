//! One row per control step.

use std::{
    fs::File,
    io::{self, BufWriter, Write},
    thread::{self, JoinHandle},
};

use ratelab::{
    cartpole::ControlStep,
    experiment::Experiment,
    runtime::{Message, Tap, TapMessage},
};

/// Names and units of the columns. Observation and action are f32, written with
/// as many digits as it takes to recover their bits.
pub const HEADER: &str = "step,time_s,cart_position_m,cart_velocity_m_s,cos_theta,sin_theta,\
                      pole_angular_velocity_rad_s,action,latency_s";

/// Control steps that may wait to be written before rows are lost to a real
/// clock, which does not wait: minutes at 50 Hz.
const BACKLOG: usize = 16_384;

/// Writes the control steps of an experiment on a thread of its own.
pub struct StepWriter(JoinHandle<io::Result<u64>>);

impl StepWriter {
    /// Writes to `file` from the first step of `experiment` to its last. A file that
    /// could not be opened is an error at the end, and no rows.
    pub fn start(file: io::Result<File>, experiment: &Experiment) -> Self {
        let tap = experiment.taps().steps(BACKLOG);
        Self(thread::spawn(move || write(file?, &tap)))
    }

    /// Waits until all is written, which takes the end of the experiment; says
    /// how many rows were lost.
    pub fn finish(self) -> io::Result<u64> {
        let written = self.0.join();
        written.unwrap_or_else(|_| Err(io::Error::other("the writer panicked")))
    }
}

/// Writes rows as long as the tap gives any; returns how many it lost.
fn write(file: File, tap: &Tap<TapMessage<ControlStep>>) -> io::Result<u64> {
    let mut out = BufWriter::new(file);
    writeln!(out, "{HEADER}")?;
    for tapped in tap.items() {
        write_row(&mut out, &tapped.message)?;
        if tap.items().is_empty() {
            out.flush()?; // Whoever follows the file sees the run as it is.
        }
    }
    out.flush()?;
    Ok(tap.lost())
}

fn write_row(out: &mut impl Write, message: &Message<ControlStep>) -> io::Result<()> {
    let step = &message.data;
    write!(out, "{},{}", step.step, message.stamp.as_secs_f64())?;
    for value in step.observation.to_array() {
        write!(out, ",{value}")?;
    }
    write!(out, ",{},", step.action.0)?;
    match step.latency {
        Some(latency) => writeln!(out, "{}", latency.as_secs_f64()),
        None => writeln!(out),
    }
}

//! One row per control step.

use std::{
    fs::File,
    io::{self, BufWriter, Write},
};

use ratelab::{
    cartpole::ControlStep,
    runtime::{Message, Tap},
};

/// Names and units of the columns. Observation and action are f32, written with
/// as many digits as it takes to recover their bits.
const HEADER: &str = "step,time_s,cart_position_m,cart_velocity_m_s,cos_theta,sin_theta,\
                      pole_angular_velocity_rad_s,action,latency_s";

/// Writes rows as long as the tap gives any; returns how many it lost.
pub fn write(file: File, tap: &Tap<ControlStep>) -> io::Result<u64> {
    let mut out = BufWriter::new(file);
    writeln!(out, "{HEADER}")?;
    for message in tap.messages() {
        write_row(&mut out, &message)?;
        if tap.messages().is_empty() {
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

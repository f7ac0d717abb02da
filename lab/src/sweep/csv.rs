//! One row per run.

use std::{
    borrow::Cow,
    fs::File,
    io::{self, BufWriter, Write},
};

use ratelab::experiment::sweep::Swept;

/// Names and units of the columns.
pub const HEADER: &str = "policy,sensor_hz,queue_depth,control_hz,seed,cause_of_end,steps,sim_time_s,\
                      mean_latency_s,obs_dropped,action_dropped,final_pole_angle_rad";

/// Writes the runs that were made, in the order of the sweep.
pub fn write(file: File, swept: &Swept) -> io::Result<()> {
    let mut out = BufWriter::new(file);
    writeln!(out, "{HEADER}")?;
    for (cell, outcome) in swept.finished() {
        let latency = outcome.mean_latency_s.map(|latency| latency.to_string());
        writeln!(
            out,
            "{},{},{},{},{},{},{},{},{},{},{},{}",
            field(&cell.policy.to_string()),
            cell.sensor_hz.get(),
            cell.queue_depth,
            cell.control_hz.get(),
            cell.seed,
            outcome.verdict.name(),
            outcome.steps,
            outcome.sim_time.as_secs_f64(),
            latency.unwrap_or_default(),
            outcome.obs_dropped,
            outcome.action_dropped,
            outcome.final_pole_angle
        )?;
    }
    out.flush()
}

/// A text as RFC 4180 has it, which may hold commas.
fn field(text: &str) -> Cow<'_, str> {
    if text.contains([',', '"', '\n', '\r']) {
        Cow::Owned(format!("\"{}\"", text.replace('"', "\"\"")))
    } else {
        Cow::Borrowed(text)
    }
}

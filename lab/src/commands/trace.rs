//! `ratelab trace`: a recording for Perfetto.

use std::slice;

use crate::{
    cli::TraceArgs,
    error::Error,
    output::{OutputKind, print_line},
    printable::shown,
    program::{self, Program},
    reading,
    trace::trace as encoded,
};

/// Writes a recording as a trace; the intact part of a damaged one.
pub fn trace(program: &Program, args: &TraceArgs) -> Result<(), Error> {
    let recording = reading::read(&args.file)?;
    let path = args
        .output
        .clone()
        .unwrap_or_else(|| args.file.with_extension("pftrace"));
    let system = recording.system(&program.for_recording(&recording).system);
    let (read, trace) = (slice::from_ref(&args.file), encoded(&recording, &*system));
    OutputKind::Trace.write("--output", &path, read, &trace)?;
    print_line(&format!(
        "{}: open it in https://ui.perfetto.dev\nwithout a network {} replay shows the run",
        shown(&path),
        program::name(),
    ))?;
    Error::if_damaged(&recording)
}

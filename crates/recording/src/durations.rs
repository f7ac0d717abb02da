//! Durations measured in a run, for draws in another run.

use std::{path::Path, time::Duration};

use ratelab::{Knob, KnobKind, TickTiming};
use ratelab_account::TickRecord;
use ratelab_study::measured::{loaded, read_column};

use crate::run::Recording;

/// `knob` with the durations of the file that it names, if they are not loaded yet: of a
/// recording the durations or the lateness of its node's ticks.
///
/// # Errors
/// An error if the file cannot be read, or has no such durations, or different ones than when
/// they were first read.
pub fn with_durations(knob: Knob) -> Result<Knob, String> {
    loaded(knob, |knob, measured| {
        let file = Path::new(measured.file());
        if !measured.is_recorded() {
            return read_column(file);
        }
        let recording = Recording::read(file).map_err(|error| error.to_string())?;
        Ok(durations(&recording, knob.kind(), knob.target()))
    })
}

/// The measurements of `node` for a knob of this `kind`.
pub fn durations(recording: &Recording, kind: KnobKind, node: &str) -> Vec<Duration> {
    let measured = match kind.sets(TickTiming::Start) {
        true => |tick: &TickRecord| tick.lateness,
        false => |tick: &TickRecord| tick.took,
    };
    let nodes = recording.nodes().filter(|(of, _)| of.name == node);
    let ticks = nodes.flat_map(|(_, ticks)| ticks);
    ticks.filter_map(measured).collect()
}

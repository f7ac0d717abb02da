//! Durations measured in a run, for draws in another run.

use std::{path::Path, time::Duration};

use ratelab::{Knob, KnobKind};
use ratelab_account::TickRecord;
use ratelab_effects::{Draw, draw, with_draw};

use super::recorded::Recording;

/// `knob` with the durations of its recording, if it names one and they are not loaded
/// yet: the durations or the lateness of its node's ticks.
///
/// # Errors
/// An error if the recording cannot be read, or has no such durations, or different ones
/// than when they were first read.
pub fn with_durations(knob: Knob) -> Result<Knob, String> {
    // The graph refuses a value that is none.
    let draw = draw(&knob).unwrap_or_default();
    let Some(recorded) = draw.as_ref().and_then(Draw::missing) else {
        return Ok(knob);
    };
    let recording = Recording::read(Path::new(recorded.file()));
    let recording = recording.map_err(|error| error.to_string())?;
    let measured = durations(&recording, knob.kind(), knob.target());
    let measured = recorded.with_durations(measured)?;
    Ok(with_draw(knob, measured.into()))
}

/// The measurements of `node` for a knob of this `kind`.
pub fn durations(recording: &Recording, kind: KnobKind, node: &str) -> Vec<Duration> {
    let measured = match kind {
        KnobKind::Wakes => |tick: &TickRecord| tick.lateness,
        _ => |tick: &TickRecord| tick.took,
    };
    let nodes = recording.origin.topology.nodes.iter();
    let nodes = nodes.zip(&recording.ticks);
    let ticks = nodes
        .filter(|(of, _)| of.name == node)
        .map(|(_, ticks)| ticks);
    ticks.flatten().filter_map(measured).collect()
}

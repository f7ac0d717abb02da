//! Durations that were measured in a run, for another run to draw from.

use std::{path::Path, time::Duration};

use ratelab::runtime::{Draw, Knob, KnobKind, TickRecord};

use super::reader::Recording;

/// `knob` with the durations of the recording that it names, if it names one and
/// does not have them yet: what the ticks of its node took, or how late they began.
///
/// # Errors
/// If the recording cannot be read, has no such durations, or others than it had.
pub fn with_durations(mut knob: Knob) -> Result<Knob, String> {
    let (kind, node) = (knob.kind(), knob.target().to_owned());
    let Some(draw) = knob.draw_mut() else {
        return Ok(knob);
    };
    let Some(recorded) = draw.missing() else {
        return Ok(knob);
    };
    let recording = Recording::read(Path::new(recorded.file()));
    let recording = recording.map_err(|error| error.to_string())?;
    *draw = Draw::from(recorded.with_durations(durations(&recording, kind, &node))?);
    Ok(knob)
}

/// What was measured of `node` that a knob of this `kind` draws from.
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

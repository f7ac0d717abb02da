//! The durations in files that a run draws from, as a recording keeps them.

use std::collections::BTreeMap;

use ratelab::{Digest, Draw, Knob};

/// The durations of files, by their digests (ns).
pub type RecordedDurations = BTreeMap<Digest, Vec<u64>>;

/// Returns the durations in files that the knobs of a run draw from.
pub fn drawn_from<'k>(knobs: impl Iterator<Item = &'k Knob>) -> RecordedDurations {
    let measured = knobs.filter_map(|knob| match knob.draw()? {
        Draw::Measured(measured) if !measured.is_recorded() => Some(measured),
        _ => None,
    });
    let durations = measured.filter_map(|measured| {
        let nanos = measured.durations()?.iter();
        let nanos = nanos.map(|duration| duration.as_nanos() as u64);
        Some((measured.digest()?, nanos.collect()))
    });
    durations.collect()
}

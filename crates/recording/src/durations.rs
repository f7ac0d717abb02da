//! Durations measured in a run, for draws in another run.

use std::{env, path::Path, time::Duration};

use ratelab::{Draw, Knob, KnobKind, Measurements, TickTiming};
use ratelab_metrics::TickRecord;
use ratelab_system::measured::{loaded, read_column};

use crate::run::{RecordedDurations, Recording};

/// Returns `knob` with the durations of the file that it names, if they are not loaded yet: of a
/// recording the durations or the lateness of its node's ticks.
///
/// # Errors
/// An error if the file cannot be read, or has no such durations, or different ones than when
/// they were first read.
pub fn with_durations(knob: Knob) -> Result<Knob, String> {
    loaded(knob, |knob, measured| {
        let file = Path::new(measured.file());
        let read = if measured.is_recorded() {
            Recording::read(file)
                .map(|recording| durations(&recording, knob.kind(), knob.target()))
                .map_err(|error| error.to_string())
        } else {
            read_column(file)
        };
        read.map_err(|why| why + &looked_for(file))
    })
}

/// Returns `knob` of a graph file in `folder` with the durations of the file that it names, whose
/// path is relative to that folder.
///
/// # Errors
/// As [`with_durations`].
pub fn with_durations_in(folder: &Path, knob: Knob) -> Result<Knob, String> {
    let missing = knob.draw().and_then(Draw::missing);
    let path = missing.map(|measured| folder.join(measured.file()));
    // A path of other letters stays as it is.
    let file = path.as_deref().and_then(Path::to_str).map(str::to_owned);
    let moved = missing.cloned().zip(file);
    let moved = moved.map(|(measured, file)| Draw::Measured(measured.with_file(file)));
    with_durations(match moved {
        Some(draw) => knob.with_draw(draw),
        None => knob,
    })
}

/// Returns `knob` with the durations of the file that it names, or with those in a recording if the
/// file is not there.
///
/// # Errors
/// As [`with_durations`].
pub fn with_recorded(recorded: &RecordedDurations, knob: Knob) -> Result<Knob, String> {
    let missing = knob.draw().and_then(Draw::missing);
    let missing = missing.filter(|measured| !Path::new(measured.file()).exists());
    let digest = missing.and_then(Measurements::digest);
    match digest.and_then(|digest| recorded.get(&digest)) {
        Some(nanos) => loaded(knob, |_, _| {
            Ok(nanos.iter().copied().map(Duration::from_nanos).collect())
        }),
        None => with_durations(knob),
    }
}

/// From where `file` was looked for, if it is not there and its path does not say that.
fn looked_for(file: &Path) -> String {
    match env::current_dir() {
        Ok(here) if file.is_relative() && !file.exists() => {
            format!(", looked for in {}", here.display())
        }
        _ => String::new(),
    }
}

/// Returns the measurements of `node` for a knob of this `kind`.
pub fn durations(recording: &Recording, kind: KnobKind, node: &str) -> Vec<Duration> {
    let measured = if kind.sets(TickTiming::Start) {
        |tick: &TickRecord| tick.lateness
    } else {
        |tick: &TickRecord| tick.took
    };
    recording
        .nodes()
        .filter(|(of, _)| of.name == node)
        .flat_map(|(_, ticks)| ticks)
        .filter_map(measured)
        .collect()
}

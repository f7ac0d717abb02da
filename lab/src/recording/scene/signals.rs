//! The signals of a system as lines over time, between their limits.

use ratelab::{runtime::Rows, system::Signal};
use rerun::{EntityPath, RecordingStream, RecordingStreamResult};

use super::{
    lines::{self, Line},
    palette::{BLUE, ORANGE},
};
use crate::recording::{progress::Progress, schema::path};

/// Entity of a signal.
pub fn entity(signal: &Signal) -> EntityPath {
    path(&["plot", "signal", signal.name])
}

/// Name and unit of a signal.
pub fn title(signal: &Signal) -> String {
    let Signal { name, unit, .. } = signal;
    if unit.is_empty() {
        (*name).to_owned()
    } else {
        format!("{name} ({unit})")
    }
}

/// Names and looks.
pub fn begin(rec: &RecordingStream, signals: &[Signal]) -> RecordingStreamResult<()> {
    for signal in signals {
        let limits = signal.limits.iter().flatten();
        let limits = limits.map(|limit| {
            let text = format!("limit {limit:+.4} {}", signal.unit);
            Line::new(text.trim_end(), ORANGE, 1.0)
        });
        let lines = std::iter::once(Line::new(title(signal), BLUE, 2.0)).chain(limits);
        lines::begin(rec, entity(signal), &lines.collect::<Vec<_>>())?;
    }
    Ok(())
}

/// The values of `signals` in the messages of the topics.
pub fn add(
    rec: &RecordingStream,
    progress: &Progress<'_>,
    signals: &[Signal],
    topics: &[(String, Rows)],
) -> RecordingStreamResult<()> {
    for signal in signals {
        let Some((_, rows)) = topics.iter().find(|(name, _)| name == signal.topic) else {
            continue;
        };
        let limits = signal.limits.iter().flatten().copied();
        let values = rows.iter().flat_map(|(_, row)| {
            let value = (signal.value)(row);
            std::iter::once(value).chain(limits.clone())
        });
        let stamps = progress.stamps_of_messages(rows.heads());
        lines::send(
            rec,
            entity(signal),
            &stamps,
            values,
            1 + limits.clone().count(),
        )?;
    }
    Ok(())
}

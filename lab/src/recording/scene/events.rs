//! The event log.

use ratelab::{Event, EventKind};
use rerun::{RecordingStream, RecordingStreamResult, TextLog, TextLogLevel};

use crate::recording::{plant_steps::PlantSteps, schema::EVENTS, timeline::Stamps};

/// Logs `events`, each at the time at which it took effect.
pub fn add(
    rec: &RecordingStream,
    progress: &PlantSteps,
    events: &[Event],
) -> RecordingStreamResult<()> {
    if events.is_empty() {
        return Ok(());
    }
    let stamps = progress.stamps_of(events.iter().map(|event| event.at));
    let texts = events.iter().map(text);
    let levels = events.iter().map(|event| level(&event.what));
    log(rec, &stamps, texts, levels)
}

/// Logs the verdict of the run.
pub fn verdict(
    rec: &RecordingStream,
    stamps: &Stamps,
    text: &str,
    lost: bool,
) -> RecordingStreamResult<()> {
    let level = if lost {
        TextLogLevel::ERROR
    } else {
        TextLogLevel::INFO
    };
    log(rec, stamps, [text.to_owned()], [level])
}

fn log(
    rec: &RecordingStream,
    stamps: &Stamps,
    texts: impl IntoIterator<Item = String>,
    levels: impl IntoIterator<Item = &'static str>,
) -> RecordingStreamResult<()> {
    let columns = TextLog::update_fields()
        .with_many_text(texts)
        .with_many_level(levels)
        .columns_of_unit_batches()?;
    rec.send_columns(EVENTS, stamps.columns(), columns)
}

/// The event without its time, which has a column of its own.
fn text(event: &Event) -> String {
    let text = event.to_string();
    match text.split_once(": ") {
        Some((_, what)) => what.to_owned(),
        None => text,
    }
}

fn level(what: &EventKind) -> &'static str {
    match what {
        EventKind::Applied { .. } => TextLogLevel::INFO,
        EventKind::Refused { .. } => TextLogLevel::WARN,
        EventKind::Presence { present: true, .. } => TextLogLevel::INFO,
        EventKind::Presence { .. } => TextLogLevel::WARN,
        EventKind::Ended { .. } | EventKind::Faulted { .. } => TextLogLevel::ERROR,
    }
}

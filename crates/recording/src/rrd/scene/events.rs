//! The event log: text for people, JSON for readers.

use ratelab::{Event, EventKind, Time};
use rerun::{SerializedComponentColumn, TextLog, TextLogLevel};

use crate::rrd::{
    columns,
    digest::ContentDigest,
    schema::EVENTS,
    timeline::{BatchStream, Written},
};

/// Logs `events`, each at the time at which it took effect, and adds them to `digest`.
pub fn add(stream: &BatchStream, events: &[Event], digest: &mut ContentDigest) -> Written {
    // A chunk sorts its rows by time, and events of different threads may be out of order.
    for ordered in events.chunk_by(|before, after| before.at <= after.at) {
        let times: Vec<Time> = ordered.iter().map(|event| event.at).collect();
        let json = ordered
            .iter()
            .map(|event| serde_json::to_string(event).unwrap_or_default())
            .inspect(|json| digest.add_event(json));
        let json = columns::texts(json)?;
        let levels = ordered.iter().map(|event| level(&event.what));
        let texts = columns_of(ordered.iter().map(text), levels)?;
        stream.send(EVENTS, &times, texts.chain([json]))?;
    }
    Ok(())
}

/// Logs the verdict of the run at run time `at`.
pub fn verdict(stream: &BatchStream, at: Time, text: &str, lost: bool) -> Written {
    let level = if lost {
        TextLogLevel::ERROR
    } else {
        TextLogLevel::INFO
    };
    stream.send(EVENTS, &[at], columns_of([text.to_owned()], [level])?)
}

fn columns_of(
    texts: impl IntoIterator<Item = String>,
    levels: impl IntoIterator<Item = &'static str>,
) -> Written<impl Iterator<Item = SerializedComponentColumn>> {
    let log = TextLog::update_fields().with_many_text(texts);
    Ok(log.with_many_level(levels).columns_of_unit_batches()?)
}

/// Returns the event without its time, which has a column of its own.
fn text(event: &Event) -> String {
    let text = event.to_string();
    match text.split_once(": ") {
        Some((_, what)) => what.to_owned(),
        None => text,
    }
}

fn level(what: &EventKind) -> &'static str {
    match what {
        EventKind::Applied { .. } | EventKind::Presence { present: true, .. } => TextLogLevel::INFO,
        EventKind::Refused { .. } | EventKind::Presence { .. } => TextLogLevel::WARN,
        EventKind::Ended { .. } | EventKind::Faulted { .. } | EventKind::Crashed { .. } => {
            TextLogLevel::ERROR
        }
    }
}

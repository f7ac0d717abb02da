//! The event log.

use ratelab::{Event, EventKind, Time};
use rerun::{TextLog, TextLogLevel};

use crate::{
    schema::EVENTS,
    timeline::{BatchStream, Written},
};

/// Logs `events`, each at the time at which it took effect.
pub fn add(stream: &BatchStream, events: &[Event]) -> Written {
    let times: Vec<Time> = events.iter().map(|event| event.at).collect();
    let levels = events.iter().map(|event| level(&event.what));
    log(stream, &times, events.iter().map(text), levels)
}

/// Logs the verdict of the run at run time `at`.
pub fn verdict(stream: &BatchStream, at: Time, text: &str, lost: bool) -> Written {
    let level = match lost {
        true => TextLogLevel::ERROR,
        false => TextLogLevel::INFO,
    };
    log(stream, &[at], [text.to_owned()], [level])
}

fn log(
    stream: &BatchStream,
    times: &[Time],
    texts: impl IntoIterator<Item = String>,
    levels: impl IntoIterator<Item = &'static str>,
) -> Written {
    let columns = TextLog::update_fields()
        .with_many_text(texts)
        .with_many_level(levels)
        .columns_of_unit_batches()?;
    stream.send(EVENTS, times, columns)
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

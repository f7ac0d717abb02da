//! The signals of a system as lines over time, between their limits. Signals of
//! one topic share an entity.

use std::iter;

use ratelab_metrics::Rows;
use ratelab_system::Signal;
use rerun::{EntityPath, RecordingStream, SeriesLines};

use super::{
    lines::{self, Line},
    palette::{BLUE, ORANGE},
};
use crate::rrd::{
    schema::path,
    timeline::{BatchStream, Written, times},
};

/// Returns the entity of the signals of the topic called `topic`.
pub fn entity(topic: &str) -> EntityPath {
    path(&["plot", "signals", topic])
}

/// Returns the name and unit of a signal.
pub fn title(signal: &Signal) -> String {
    let Signal { name, unit, .. } = signal;
    if unit.is_empty() {
        name.to_string()
    } else {
        format!("{name} ({unit})")
    }
}

/// Selects the lines of the signal called `name` from the lines of its topic.
pub fn only(signals: &[Signal], topic: &str, name: &str) -> SeriesLines {
    let visible = shown_of(signals, topic)
        .flat_map(|signal| iter::repeat_n(signal.name == name, lines_of(signal).len()));
    SeriesLines::update_fields().with_visible_series(visible.collect::<Vec<_>>())
}

/// Logs how the signals of `topic` look.
pub fn begin(rec: &RecordingStream, signals: &[Signal], topic: &str) -> Written {
    let lines: Vec<Line> = shown_of(signals, topic).flat_map(lines_of).collect();
    if lines.is_empty() {
        return Ok(());
    }
    lines::begin(rec, entity(topic), &lines)
}

/// Logs the signals of `topic` in its messages.
pub fn add(stream: &BatchStream, signals: &[Signal], topic: &str, messages: &Rows) -> Written {
    let signals: Vec<&Signal> = shown_of(signals, topic).collect();
    let count = signals.iter().map(|signal| lines_of(signal).len()).sum();
    if count == 0 {
        return Ok(());
    }
    let values = messages.iter().flat_map(|(_, row)| {
        signals.iter().flat_map(move |signal| {
            let limits = signal.limits.into_iter().flatten();
            iter::once(signal.value.of(row)).chain(limits)
        })
    });
    let times = times(messages.heads());
    lines::send(stream, entity(topic), &times, values, count)
}

fn shown_of<'a>(signals: &'a [Signal], topic: &str) -> impl Iterator<Item = &'a Signal> {
    signals.iter().filter(move |signal| signal.topic == topic)
}

/// Returns the line of a signal, and the lines of its limits.
fn lines_of(signal: &Signal) -> Vec<Line> {
    let limits = signal.limits.into_iter().flatten().map(|limit| {
        let rounded = (limit * 1e3).round() / 1e3;
        let text = format!("limit {rounded:+} {}", signal.unit);
        Line::new(text.trim_end(), ORANGE, 1.0)
    });
    iter::once(Line::new(title(signal), BLUE, 2.0))
        .chain(limits)
        .collect()
}

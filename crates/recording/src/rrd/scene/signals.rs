//! Signals between their limits, and the clock, rates and states of nodes, over time.

use std::iter;

use ratelab::{ClockKind, Command, Event, Knob, Time};
use ratelab_metrics::{Rows, Snapshot};
use ratelab_system::Signal;
use rerun::{EntityPath, RecordingStream, SeriesLines};

use super::{
    lanes,
    lines::{self, BLUE, GREY, Line, ORANGE, series},
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
            iter::once(signal.value.compute(row)).chain(limits)
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

/// The lanes.
pub const MODES: &str = "mode";

/// States of a node.
const RUNS: &str = "runs";
const CRASHED: &str = "crashed";
const HANGS: &str = "hangs";

/// The lanes so far: each node with every rate that it had, in the order of their first use.
pub struct Modes(Vec<(String, Vec<String>)>);

impl Modes {
    /// Creates the lanes at the beginning.
    pub fn new(start: &Snapshot) -> Self {
        let nodes = start.nodes.iter();
        Self(
            nodes
                .map(|node| (node.name.to_string(), Vec::new()))
                .collect(),
        )
    }

    /// Logs the beginning of the lanes.
    pub fn begin(&mut self, rec: &RecordingStream, start: &Snapshot) -> Written {
        send_clocks(rec, &[(Time::ZERO, start.status.clock.to_string())])?;
        for ((node, rates), state) in self.0.iter_mut().zip(&start.nodes) {
            send_rates(rec, node, rates, &[(Time::ZERO, state.hz.to_string())])?;
        }
        Ok(())
    }

    /// Logs what `events` changed. A node has a lane of its state from its first fault on.
    pub fn add(&mut self, rec: &RecordingStream, events: &[Event]) -> Written {
        let handed_over = |command: &Command| match command {
            Command::HandOver(clock) => Some(clock.to_string()),
            _ => None,
        };
        send_clocks(rec, &changes(events, handed_over))?;
        for (node, rates) in &mut self.0 {
            let turned = |command: &Command| match command {
                Command::Set(Knob::Rate { node: of, hz }) if of == node => Some(hz.to_string()),
                _ => None,
            };
            send_rates(rec, node, rates, &changes(events, turned))?;
            let looks = [(RUNS, BLUE), (CRASHED, ORANGE), (HANGS, GREY)];
            let lane = path(&[MODES, "state", node]);
            lanes::send(rec, lane, &looks, &faults(node, events))?;
        }
        Ok(())
    }
}

fn send_clocks(rec: &RecordingStream, changes: &[(Time, String)]) -> Written {
    let looks = [(ClockKind::Virtual, BLUE), (ClockKind::Real, ORANGE)]
        .map(|(clock, colour)| (clock.to_string(), colour));
    lanes::send(rec, path(&[MODES, "clock"]), &looks, changes)
}

/// Logs the changes of the rate of a node, which has had some `rates`.
fn send_rates(
    rec: &RecordingStream,
    node: &str,
    rates: &mut Vec<String>,
    changes: &[(Time, String)],
) -> Written {
    for (_, rate) in changes {
        if !rates.contains(rate) {
            rates.push(rate.clone());
        }
    }
    let looks: Vec<_> = rates.iter().zip(series(rates.len())).collect();
    lanes::send(rec, path(&[MODES, "rate", node]), &looks, changes)
}

/// Returns when a mode changed by a command among `events`, and to what.
fn changes(events: &[Event], mode: impl Fn(&Command) -> Option<String>) -> Vec<(Time, String)> {
    events
        .iter()
        .filter_map(|event| Some((event.at, mode(event.applied()?)?)))
        .collect()
}

/// Returns when `node` crashed, hung and ran again.
fn faults(node: &str, events: &[Event]) -> Vec<(Time, &'static str)> {
    let changes = events
        .iter()
        .filter_map(Event::change)
        .filter(|timed| timed.knob.target() == node)
        .flat_map(|timed| match timed.knob {
            Knob::Crash { .. } => vec![(timed.at, CRASHED)],
            Knob::Restart { .. } => vec![(timed.at, RUNS)],
            Knob::Hang { cost, .. } => vec![(timed.at, HANGS), (timed.at + cost, RUNS)],
            _ => Vec::new(),
        });
    changes.collect()
}

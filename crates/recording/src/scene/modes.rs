//! The clock, the rate of each node and whether it runs, over time, as lanes.

use ratelab::{ClockKind, Command, Event, Knob, Time};
use rerun::{Color, RecordingStream};

use super::{
    lanes,
    palette::{BLUE, GREY, ORANGE, series},
};
use crate::{recorded::Recording, schema::path, timeline::Written};

/// The lanes.
pub const MODES: &str = "mode";

/// States of a node.
const RUNS: &str = "runs";
const CRASHED: &str = "crashed";
const HANGS: &str = "hangs";

/// Logs the lanes of `recording`. A node that never had a fault has no lane of its state.
pub fn add(rec: &RecordingStream, recording: &Recording) -> Written {
    let (origin, events) = (&recording.origin, &recording.events);
    let looks = [(ClockKind::Virtual, BLUE), (ClockKind::Real, ORANGE)];
    let looks = looks.map(|(clock, colour)| (clock.to_string(), colour));
    let handed_over = |command: &Command| match command {
        Command::HandOver(clock) => Some(clock.to_string()),
        _ => None,
    };
    let clocks = changes(origin.config.clock.to_string(), events, handed_over);
    lanes::send(rec, path(&[MODES, "clock"]), &looks, &clocks)?;
    for node in &origin.topology.nodes {
        let turned = |command: &Command| match command {
            Command::Set(Knob::Rate { node: of, hz }) if *of == node.name => Some(hz.to_string()),
            _ => None,
        };
        let rates = changes(node.hz.to_string(), events, turned);
        let lane = path(&[MODES, "rate", &node.name]);
        lanes::send(rec, lane, &looks_of(&rates), &rates)?;
        let lane = path(&[MODES, "state", &node.name]);
        let looks = [(RUNS, BLUE), (CRASHED, ORANGE), (HANGS, GREY)];
        lanes::send(rec, lane, &looks, &faults(&node.name, events))?;
    }
    Ok(())
}

/// The `first` mode, then each that a command among `events` brought.
fn changes(
    first: String,
    events: &[Event],
    mode: impl Fn(&Command) -> Option<String>,
) -> Vec<(Time, String)> {
    let later = events.iter().filter_map(|event| {
        let mode = mode(event.applied()?)?;
        Some((event.at, mode))
    });
    [(Time::ZERO, first)].into_iter().chain(later).collect()
}

/// A colour for each rate, in the order of their first use.
fn looks_of(rates: &[(Time, String)]) -> Vec<(&str, Color)> {
    let mut names: Vec<&str> = Vec::new();
    for (_, rate) in rates {
        if !names.contains(&&**rate) {
            names.push(rate);
        }
    }
    let colours = series(names.len());
    names.into_iter().zip(colours).collect()
}

/// When `node` crashed, hung and ran again.
fn faults(node: &str, events: &[Event]) -> Vec<(Time, &'static str)> {
    let knobs = events.iter().filter_map(Event::knob);
    let changes = knobs.filter(|timed| timed.knob.target() == node);
    let changes = changes.flat_map(|timed| match timed.knob {
        Knob::Crash { .. } => vec![(timed.at, CRASHED)],
        Knob::Restart { .. } => vec![(timed.at, RUNS)],
        Knob::Hang { cost, .. } => vec![(timed.at, HANGS), (timed.at + cost, RUNS)],
        _ => Vec::new(),
    });
    changes.collect()
}

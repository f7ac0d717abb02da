//! The clock, the rate of each node and whether it runs, over time, as lanes.

use ratelab::{ClockKind, Command, Event, Knob, Time};
use ratelab_metrics::Snapshot;
use rerun::RecordingStream;

use super::{
    lanes,
    palette::{BLUE, GREY, ORANGE, series},
};
use crate::rrd::{schema::path, timeline::Written};

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
    let changes = events.iter();
    changes
        .filter_map(|event| Some((event.at, mode(event.applied()?)?)))
        .collect()
}

/// Returns when `node` crashed, hung and ran again.
fn faults(node: &str, events: &[Event]) -> Vec<(Time, &'static str)> {
    let knobs = events.iter().filter_map(Event::change);
    let changes = knobs
        .filter(|timed| timed.knob.target() == node)
        .flat_map(|timed| match timed.knob {
            Knob::Crash { .. } => vec![(timed.at, CRASHED)],
            Knob::Restart { .. } => vec![(timed.at, RUNS)],
            Knob::Hang { cost, .. } => vec![(timed.at, HANGS), (timed.at + cost, RUNS)],
            _ => Vec::new(),
        });
    changes.collect()
}

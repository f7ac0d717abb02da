//! The clock and the rate of each node over time, as lanes.

use ratelab::{ClockKind, Command, Event, Knob, Time};
use ratelab_account::Snapshot;
use rerun::{Color, EntityPath, RecordingStream, StateChange, StateConfiguration};

use super::palette::{BLUE, GREY, ORANGE, series};
use crate::{
    schema::path,
    timeline::{BatchStream, Written},
};

/// The lanes.
pub const MODES: &str = "mode";

const CLOCK: &str = "mode/clock";

/// States of a node.
const RUNS: &str = "runs";
const CRASHED: &str = "crashed";
const HANGS: &str = "hangs";

/// The lane of the rates of each node.
pub struct Modes(Vec<RateLane>);

struct RateLane {
    node: String,
    entity: EntityPath,
    /// Every rate that there was, in the order of its first use.
    rates: Vec<String>,
}

impl Modes {
    /// The lanes at the beginning.
    pub fn new(start: &Snapshot) -> Self {
        let lanes = start.nodes.iter().map(|node| RateLane {
            node: node.name.to_string(),
            entity: path(&["mode", "rate", &node.name]),
            rates: vec![node.hz.to_string()],
        });
        Self(lanes.collect())
    }

    /// Logs the beginning of the lanes.
    pub fn begin(&self, stream: &BatchStream, start: &Snapshot) -> Written {
        let clocks = [ClockKind::Virtual, ClockKind::Real].map(|clock| clock.to_string());
        colour(&stream.rec, CLOCK, &clocks, [BLUE, ORANGE])?;
        let clock = start.status.clock.to_string();
        log(stream, CLOCK, &[(Time::ZERO, clock)])?;
        for lane in &self.0 {
            let first = lane.rates.iter().map(|rate| (Time::ZERO, rate));
            log(stream, lane.entity.clone(), &first.collect::<Vec<_>>())?;
            lane.colour(&stream.rec)?;
        }
        Ok(())
    }

    /// Logs what `events` changed: a column per lane, and the colours once. A node has a
    /// lane of its state from its first fault on.
    pub fn add(&mut self, stream: &BatchStream, events: &[Event]) -> Written {
        let clocks = changes(events, |command| match command {
            Command::HandOver(clock) => Some(clock.to_string()),
            _ => None,
        });
        log(stream, CLOCK, &clocks)?;
        for lane in &mut self.0 {
            let rates = changes(events, |command| match command {
                Command::Set(Knob::Rate { node, hz }) if *node == lane.node => Some(hz.to_string()),
                _ => None,
            });
            log(stream, lane.entity.clone(), &rates)?;
            lane.learn(&stream.rec, rates)?;
            log_faults(stream, &lane.node, events)?;
        }
        Ok(())
    }
}

/// Logs whether `node` runs, crashed or hangs, where one of `events` is about that.
fn log_faults(stream: &BatchStream, node: &str, events: &[Event]) -> Written {
    let knobs = events.iter().filter_map(Event::knob);
    let changes = knobs.filter(|timed| timed.knob.target() == node);
    let changes = changes.flat_map(|timed| {
        let at = timed.at;
        match timed.knob {
            Knob::Crash { .. } => vec![(at, CRASHED)],
            Knob::Restart { .. } => vec![(at, RUNS)],
            Knob::Hang { cost, .. } => vec![(at, HANGS), (at + cost, RUNS)],
            _ => Vec::new(),
        }
    });
    let changes: Vec<_> = changes.collect();
    if changes.is_empty() {
        return Ok(());
    }
    let lane = path(&["mode", "state", node]);
    let states = [RUNS, CRASHED, HANGS];
    colour(&stream.rec, lane.clone(), states, [BLUE, ORANGE, GREY])?;
    log(stream, lane, &changes)
}

impl RateLane {
    /// Takes in `rates`, some of which may be new.
    fn learn(&mut self, rec: &RecordingStream, rates: Vec<(Time, String)>) -> Written {
        let before = self.rates.len();
        for (_, rate) in rates {
            if !self.rates.contains(&rate) {
                self.rates.push(rate);
            }
        }
        match self.rates.len() > before {
            true => self.colour(rec),
            false => Ok(()),
        }
    }

    /// A colour for each rate, in place of the earlier ones.
    fn colour(&self, rec: &RecordingStream) -> Written {
        let colours = series(self.rates.len());
        colour(rec, self.entity.clone(), &self.rates, colours)
    }
}

/// When `mode` has a value for a command among `events`, and which.
fn changes(events: &[Event], mode: impl Fn(&Command) -> Option<String>) -> Vec<(Time, String)> {
    let changes = events.iter();
    changes
        .filter_map(|event| Some((event.at, mode(event.applied()?)?)))
        .collect()
}

/// Logs the colours of the `states` of a lane.
pub fn colour<S: AsRef<str>>(
    rec: &RecordingStream,
    lane: impl Into<EntityPath>,
    states: impl IntoIterator<Item = S>,
    colours: impl IntoIterator<Item = Color>,
) -> Written {
    let states: Vec<S> = states.into_iter().collect();
    let looks = StateConfiguration::new()
        .with_values(states.iter().map(AsRef::as_ref))
        .with_colors(colours);
    rec.log_static(lane, &looks)
}

/// Logs when a lane changed, and to what.
fn log(
    stream: &BatchStream,
    lane: impl Into<EntityPath>,
    changes: &[(Time, impl AsRef<str>)],
) -> Written {
    let times: Vec<Time> = changes.iter().map(|(at, _)| *at).collect();
    let states = changes.iter().map(|(_, state)| state.as_ref());
    let rows = StateChange::new().with_state(states);
    stream.send(lane, &times, rows.columns_of_unit_batches()?)
}

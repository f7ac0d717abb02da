//! The clock and the rate of each node over time, as lanes.

use std::collections::HashSet;

use ratelab::{ClockKind, Command, Event, Knob, Time};
use ratelab_account::Snapshot;
use rerun::{EntityPath, RecordingStream, RecordingStreamResult, StateChange, StateConfiguration};

use super::palette::{BLUE, GREY, ORANGE, series};
use crate::recording::{plant_steps::PlantSteps, schema::path, timeline::Stamps};

/// The lanes.
pub const MODES: &str = "mode";

const CLOCK: &str = "mode/clock";

/// States of a node.
const RUNS: &str = "runs";
const CRASHED: &str = "crashed";
const HANGS: &str = "hangs";

/// The lanes as they go.
pub struct Modes {
    clock: String,
    rates: Vec<RateLane>,
}

/// The lane of a node.
struct RateLane {
    node: String,
    entity: EntityPath,
    /// Every rate that there was, in the order of its first use.
    rates: Vec<String>,
    /// The same, to look one up.
    known: HashSet<String>,
}

/// When a lane changed, and to what.
type Changes = Vec<(Time, String)>;

impl Modes {
    /// The lanes at the beginning.
    pub fn new(start: &Snapshot) -> Self {
        let lanes = start.nodes.iter().map(|node| RateLane {
            node: node.name.to_string(),
            entity: path(&["mode", "rate", &node.name]),
            rates: vec![node.hz.to_string()],
            known: HashSet::from([node.hz.to_string()]),
        });
        Self {
            clock: start.status.clock.to_string(),
            rates: lanes.collect(),
        }
    }

    /// Logs the beginning of the lanes.
    pub fn begin(&self, rec: &RecordingStream, stamps: &Stamps) -> RecordingStreamResult<()> {
        let clocks = [ClockKind::Virtual, ClockKind::Real];
        let colours = StateConfiguration::new()
            .with_values(clocks.map(|clock| clock.to_string()))
            .with_colors([BLUE, ORANGE]);
        rec.log_static(CLOCK, &colours)?;
        log(rec, CLOCK, stamps, [self.clock.as_str()])?;
        for lane in &self.rates {
            let first = lane.rates.iter().map(String::as_str);
            log(rec, lane.entity.clone(), stamps, first)?;
            lane.colour(rec)?;
        }
        Ok(())
    }

    /// Logs what `events` changed: a column per lane, and the colours once. A node has a
    /// lane of its state from its first fault on.
    pub fn add(
        &mut self,
        rec: &RecordingStream,
        progress: &PlantSteps,
        events: &[Event],
    ) -> RecordingStreamResult<()> {
        let clocks = changes(events, |command| match command {
            Command::HandOver(clock) => Some(clock.to_string()),
            _ => None,
        });
        log_changes(rec, CLOCK, progress, &clocks)?;
        for lane in &mut self.rates {
            let rates = changes(events, |command| match command {
                Command::Set(Knob::Rate { node, hz }) if *node == lane.node => Some(hz.to_string()),
                _ => None,
            });
            log_changes(rec, lane.entity.clone(), progress, &rates)?;
            lane.learn(rec, rates)?;
            log_faults(rec, progress, &lane.node, events)?;
        }
        Ok(())
    }
}

/// Logs whether `node` runs, crashed or hangs, where one of `events` is about that.
fn log_faults(
    rec: &RecordingStream,
    progress: &PlantSteps,
    node: &str,
    events: &[Event],
) -> RecordingStreamResult<()> {
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
    let changes: Changes = changes.map(|(at, state)| (at, state.to_owned())).collect();
    if changes.is_empty() {
        return Ok(());
    }
    let lane = path(&["mode", "state", node]);
    let colours = StateConfiguration::new()
        .with_values([RUNS, CRASHED, HANGS])
        .with_colors([BLUE, ORANGE, GREY]);
    rec.log_static(lane.clone(), &colours)?;
    log_changes(rec, lane, progress, &changes)
}

impl RateLane {
    /// Takes in `rates`, some of which may be new.
    fn learn(&mut self, rec: &RecordingStream, rates: Changes) -> RecordingStreamResult<()> {
        let before = self.rates.len();
        let rates = rates.into_iter().map(|(_, rate)| rate);
        let new = rates.filter(|rate| self.known.insert(rate.clone()));
        self.rates.extend(new);
        if self.rates.len() > before {
            self.colour(rec)?;
        }
        Ok(())
    }

    /// A colour for each rate, in place of the earlier ones.
    fn colour(&self, rec: &RecordingStream) -> RecordingStreamResult<()> {
        let colours = StateConfiguration::new()
            .with_values(self.rates.iter().map(String::as_str))
            .with_colors(series(self.rates.len()));
        rec.log_static(self.entity.clone(), &colours)
    }
}

/// When `mode` has a value for a command among `events`, and which.
fn changes(events: &[Event], mode: impl Fn(&Command) -> Option<String>) -> Changes {
    let changes = events.iter();
    changes
        .filter_map(|event| Some((event.at, mode(event.applied()?)?)))
        .collect()
}

fn log_changes(
    rec: &RecordingStream,
    lane: impl Into<EntityPath>,
    progress: &PlantSteps,
    changes: &Changes,
) -> RecordingStreamResult<()> {
    let stamps = progress.stamps_of(changes.iter().map(|(at, _)| *at));
    log(rec, lane, &stamps, changes.iter().map(|(_, mode)| &**mode))
}

/// A row for each of `modes`.
fn log<'a>(
    rec: &RecordingStream,
    lane: impl Into<EntityPath>,
    stamps: &Stamps,
    modes: impl IntoIterator<Item = &'a str>,
) -> RecordingStreamResult<()> {
    if stamps.is_empty() {
        return Ok(());
    }
    let rows = StateChange::new().with_state(modes);
    rec.send_columns(lane, stamps.columns(), rows.columns_of_unit_batches()?)
}

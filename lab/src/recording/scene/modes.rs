//! What was in force for how long: the clock and the control rate.

use std::collections::HashSet;

use ratelab::{
    cartpole::POLICY,
    runtime::{
        ClockKind, Command, Snapshot, Time,
        telemetry::{Event, EventKind},
    },
};
use rerun::{RecordingStream, RecordingStreamResult, StateChange, StateConfiguration};

use super::palette::{BLUE, ORANGE, series};
use crate::recording::{progress::Progress, timeline::Stamps};

/// The lanes.
pub const MODES: &str = "mode";

const CLOCK: &str = "mode/clock";
const CONTROL_RATE: &str = "mode/control_rate";

/// The lanes as they go.
pub struct Modes {
    clock: String,
    /// Every control rate that there was, in the order of its first use.
    rates: Vec<String>,
    /// The same, to look one up.
    known: HashSet<String>,
}

/// When a lane changed, and to what.
type Changes = Vec<(Time, String)>;

impl Modes {
    /// What holds at the beginning.
    pub fn new(start: &Snapshot) -> Self {
        let policy = start.node(POLICY).into_iter();
        let rates: Vec<String> = policy.map(|policy| policy.hz.to_string()).collect();
        Self {
            clock: start.status.clock.to_string(),
            known: rates.iter().cloned().collect(),
            rates,
        }
    }

    /// Logs what holds at the beginning.
    pub fn begin(&self, rec: &RecordingStream, stamps: &Stamps) -> RecordingStreamResult<()> {
        let clocks = [ClockKind::Virtual, ClockKind::Real];
        let colours = StateConfiguration::new()
            .with_values(clocks.map(|clock| clock.to_string()))
            .with_colors([BLUE, ORANGE]);
        rec.log_static(CLOCK, &colours)?;
        log(rec, CLOCK, stamps, [self.clock.as_str()])?;
        for rate in &self.rates {
            log(rec, CONTROL_RATE, stamps, [rate.as_str()])?;
        }
        self.colour_rates(rec)
    }

    /// Logs what `events` changed: a column per lane, and the colours once.
    pub fn add(
        &mut self,
        rec: &RecordingStream,
        progress: &Progress,
        events: &[Event],
    ) -> RecordingStreamResult<()> {
        let (mut clocks, mut rates) = (Changes::new(), Changes::new());
        for event in events {
            let EventKind::Applied { command, .. } = &event.what else {
                continue;
            };
            match command {
                Command::HandOver(clock) => clocks.push((event.at, clock.to_string())),
                Command::SetRate { node, hz } if node == POLICY => {
                    rates.push((event.at, hz.to_string()));
                }
                _ => {}
            }
        }
        for (lane, changes) in [(CLOCK, &clocks), (CONTROL_RATE, &rates)] {
            let stamps = progress.stamps_of(changes.iter().map(|(at, _)| *at));
            log(rec, lane, &stamps, changes.iter().map(|(_, mode)| &**mode))?;
        }
        let before = self.rates.len();
        let rates = rates.into_iter().map(|(_, rate)| rate);
        let new = rates.filter(|rate| self.known.insert(rate.clone()));
        self.rates.extend(new);
        if self.rates.len() > before {
            self.colour_rates(rec)?;
        }
        Ok(())
    }

    /// A colour for each rate, which replaces what was said before.
    fn colour_rates(&self, rec: &RecordingStream) -> RecordingStreamResult<()> {
        let colours = StateConfiguration::new()
            .with_values(self.rates.iter().map(String::as_str))
            .with_colors(series(self.rates.len()));
        rec.log_static(CONTROL_RATE, &colours)
    }
}

/// A row for each of `modes`.
fn log<'a>(
    rec: &RecordingStream,
    lane: &str,
    stamps: &Stamps,
    modes: impl IntoIterator<Item = &'a str>,
) -> RecordingStreamResult<()> {
    if stamps.is_empty() {
        return Ok(());
    }
    let rows = StateChange::new().with_state(modes);
    rec.send_columns(lane, stamps.columns(), rows.columns_of_unit_batches()?)
}

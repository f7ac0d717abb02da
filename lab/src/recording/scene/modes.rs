//! What was in force for how long: the clock and the control rate.

use ratelab::{
    cartpole::POLICY,
    runtime::{
        ClockKind, Command, Snapshot,
        telemetry::{Event, Happening},
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
}

impl Modes {
    /// What holds at the beginning.
    pub fn new(start: &Snapshot) -> Self {
        let policy = start.node(POLICY).into_iter();
        Self {
            clock: start.status.clock.to_string(),
            rates: policy.map(|policy| policy.hz.to_string()).collect(),
        }
    }

    /// Logs what holds at the beginning.
    pub fn begin(&self, rec: &RecordingStream, stamps: &Stamps) -> RecordingStreamResult<()> {
        let clocks = [ClockKind::Virtual, ClockKind::Real];
        let colours = StateConfiguration::new()
            .with_values(clocks.map(|clock| clock.to_string()))
            .with_colors([BLUE, ORANGE]);
        rec.log_static(CLOCK, &colours)?;
        log(rec, CLOCK, stamps, &self.clock)?;
        for rate in &self.rates {
            log(rec, CONTROL_RATE, stamps, rate)?;
        }
        self.colour_rates(rec)
    }

    /// Logs what `events` changed.
    pub fn add(
        &mut self,
        rec: &RecordingStream,
        progress: &Progress,
        events: &[Event],
    ) -> RecordingStreamResult<()> {
        for event in events {
            let stamps = progress.stamp(event.at);
            let Happening::Applied { command, .. } = &event.what else {
                continue;
            };
            match command {
                Command::HandOver(clock) => log(rec, CLOCK, &stamps, &clock.to_string())?,
                Command::SetRate { node, hz } if node == POLICY => {
                    let rate = hz.to_string();
                    log(rec, CONTROL_RATE, &stamps, &rate)?;
                    if !self.rates.contains(&rate) {
                        self.rates.push(rate);
                        self.colour_rates(rec)?;
                    }
                }
                _ => {}
            }
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

fn log(
    rec: &RecordingStream,
    lane: &str,
    stamps: &Stamps,
    mode: &str,
) -> RecordingStreamResult<()> {
    let columns = StateChange::single(mode).columns([1])?;
    rec.send_columns(lane, stamps.columns(), columns)
}

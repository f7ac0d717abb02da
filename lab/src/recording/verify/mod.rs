//! Runs a recorded run again and compares, bit for bit.

mod again;
mod compare;
mod difference;
mod end;
mod events;
mod series;
mod topology;

use std::{fmt, ops::ControlFlow};

use ratelab::{
    cartpole::mujoco_version,
    experiment::{ACTION, OBS, STATE, SetupError},
    runtime::{
        ClockKind, Command, Time,
        telemetry::{Event, EventKind},
    },
};
use thiserror::Error;

use self::{again::run_again, difference::Difference};
use super::{reader::Recording, schema::platform};

/// Why a recording cannot be run again, or is not what comes of it.
#[derive(Debug, Error)]
pub enum VerifyError {
    /// The order of what happened is not in the recording.
    #[error(
        "this run was {0} under the real clock, where the system decides in which order \
         threads run: the same run does not come twice, so there is nothing to verify"
    )]
    RealClock(&'static str),
    /// There is nothing in it.
    #[error("there is nothing in it to verify: no message of {0} was recorded")]
    Nothing(&'static str),
    /// The run that comes of it is another one.
    #[error("{difference}{}", if_made_elsewhere(.made))]
    Differs {
        /// Where.
        difference: Box<Difference>,
        /// By what it was made, if by other software than this.
        made: Option<String>,
    },
    /// Whoever watched ended it.
    #[error("stopped before all of it was compared")]
    Stopped,
    /// It cannot be run at all.
    #[error(transparent)]
    Setup(#[from] SetupError),
}

fn if_made_elsewhere(made: &Option<String>) -> String {
    let made = made.as_ref();
    made.map_or_else(String::new, |made| format!(" (it was made with {made})"))
}

/// What was found to be the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identical {
    /// Topics compared.
    pub topics: usize,
    /// Messages compared.
    pub messages: usize,
    /// Ticks compared.
    pub ticks: usize,
}

impl fmt::Display for Identical {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [messages, ticks] = [self.messages, self.ticks].map(thousands);
        let topics = self.topics;
        write!(
            f,
            "identical, {topics} topics, {messages} messages, {ticks} ticks"
        )
    }
}

/// With commas between groups of three digits.
fn thousands(number: usize) -> String {
    let digits = number.to_string();
    let groups: Vec<&str> = digits
        .as_bytes()
        .rchunks(3)
        .rev()
        .filter_map(|group| std::str::from_utf8(group).ok())
        .collect();
    groups.join(",")
}

/// Runs what `recording` says was run, with the commands that were given, and
/// compares the graph, every message, every tick, every event and how the run
/// ended. What is the wall's is not compared: how long a tick or the run took, when
/// it was paused and how fast it went. `watch` is told the run time now and then,
/// and ends it if it breaks.
///
/// # Errors
/// [`VerifyError`] if it is not the same, or cannot be told.
pub fn verify(
    recording: &Recording,
    watch: impl FnMut(Time) -> ControlFlow<()> + Send,
) -> Result<Identical, VerifyError> {
    refuse_real_clock(recording)?;
    let tracks = [OBS, ACTION, STATE].map(|name| (name, recording.track(name)));
    for (name, track) in tracks {
        // A policy too slow for a short recording is silent in it.
        if track.is_none_or(|track| name != ACTION && track.heads.is_empty()) {
            return Err(VerifyError::Nothing(name));
        }
    }
    let mut differences = run_again(recording, tracks.map(|(_, track)| track), watch)?;
    differences.sort_by_key(|difference| difference.at);
    match differences.into_iter().next() {
        Some(difference) => Err(VerifyError::Differs {
            difference: Box::new(difference),
            made: made_elsewhere(recording),
        }),
        None => Ok(Identical {
            topics: tracks.len(),
            messages: tracks
                .iter()
                .flat_map(|(_, track)| track)
                .map(|t| t.heads.len())
                .sum(),
            ticks: recording.ticks.iter().map(Vec::len).sum(),
        }),
    }
}

fn refuse_real_clock(recording: &Recording) -> Result<(), VerifyError> {
    let handed_over = |event: &Event| {
        matches!(
            event.what,
            EventKind::Applied {
                command: Command::HandOver(ClockKind::Real),
                ..
            }
        )
    };
    match recording.origin.config.clock {
        ClockKind::Real => Err(VerifyError::RealClock("begun")),
        _ if recording.events.iter().any(handed_over) => Err(VerifyError::RealClock("for a while")),
        _ => Ok(()),
    }
}

/// What made the recording, if that may compute other bits than this program.
fn made_elsewhere(recording: &Recording) -> Option<String> {
    let origin = &recording.origin;
    let ours = (env!("CARGO_PKG_VERSION"), mujoco_version(), platform());
    let theirs = (&*origin.ratelab, &*origin.mujoco, origin.platform.clone());
    (ours != theirs).then(|| {
        let (ratelab, mujoco, platform) = theirs;
        format!("ratelab {ratelab}, MuJoCo {mujoco}, {platform}")
    })
}

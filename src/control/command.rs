//! Commands that change a running graph, and why a graph refuses a setting.

use std::fmt;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::knob::{Knob, TimedKnob};
use crate::{millis, time::Time};

/// A request to a running graph, from a person or a script. Takes effect between calls
/// of a node, under either clock, and is logged with that run time.
///
/// ```
/// use ratelab::{Clock, Command, Graph, Hz, Inbox, Knob, Tick, Time, TimedCommand, VirtualClock};
///
/// let mut graph = Graph::new();
/// graph.node("policy", Hz::new(50.0)?, 0, |_| |_: &mut Tick| {})?;
/// let slower = Command::Set(Knob::Rate { node: "policy".to_owned(), hz: Hz::new(5.0)? });
/// let at = Time::from_secs_f64(1.0)?;
/// let (_live, mut inbox) = Inbox::new(vec![TimedCommand { at, command: slower }]);
///
/// VirtualClock.run(&mut graph, &mut inbox, Time::from_secs_f64(2.0)?)?;
/// let events = graph.state().events(0);
/// assert_eq!(events[0].to_string(), "1.000 s: policy at 5 Hz (was 50 Hz)");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Command {
    /// Stop run time.
    Pause,
    /// Let run time go on.
    Resume,
    /// Run exactly one tick of one node, then pause. Virtual clock only.
    Step,
    /// Set how fast run time passes. Virtual clock only.
    Speed(Speed),
    /// Hand the running graph to a clock of this kind.
    HandOver(ClockKind),
    /// End the run normally.
    Stop,
    /// Set a knob. The log shows the knob alone.
    #[serde(untagged)]
    Set(Knob),
}

impl From<Knob> for Command {
    fn from(knob: Knob) -> Self {
        Self::Set(knob)
    }
}

impl From<TimedKnob> for TimedCommand {
    fn from(TimedKnob { at, knob }: TimedKnob) -> Self {
        let command = knob.into();
        Self { at, command }
    }
}

impl Command {
    /// Returns whether it changes the graph or stops its clock, rather than the passing of run
    /// time: such a command waits until no instant is half done.
    pub(crate) fn changes_graph(&self) -> bool {
        match self {
            Self::Set(_) | Self::HandOver(_) | Self::Stop => true,
            Self::Pause | Self::Resume | Self::Step | Self::Speed(_) => false,
        }
    }

    /// Returns the value `before` it was carried out, as the log has it.
    pub(crate) fn replaced(&self, before: Option<&Knob>) -> Option<String> {
        match self {
            Self::Set(knob) => Some(knob.replaced(before?)),
            _ => None,
        }
    }

    /// Returns the name of the node that must carry it out.
    pub fn node(&self) -> Option<&str> {
        self.knob_of_node().map(Knob::target)
    }

    /// Returns the knob of a node that it sets.
    pub(crate) fn knob_of_node(&self) -> Option<&Knob> {
        match self {
            Self::Set(knob) if !knob.kind().is_of_topic() => Some(knob),
            _ => None,
        }
    }
}

impl fmt::Display for Command {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Set(Knob::Rate { node, hz }) => write!(f, "{node} at {hz}"),
            Self::Set(Knob::Depth { topic, depth }) => write!(f, "{topic} depth {depth}"),
            Self::Set(Knob::Send { node, text }) => write!(f, "{node}: {text}"),
            Self::Set(Knob::Parameter { node, name, value }) => write!(f, "{node} {name} {value}"),
            Self::Set(Knob::Takes { node, cost }) => write!(f, "{node} takes {cost}"),
            Self::Set(Knob::Offset { node, offset }) => {
                write!(f, "{node} offset {} ms", millis::to_millis(*offset))
            }
            Self::Set(Knob::Wakes { node, lateness }) => write!(f, "{node} wakes {lateness}"),
            Self::Set(knob) => knob.fmt(f),
            Self::Pause => f.write_str("pause"),
            Self::Resume => f.write_str("resume"),
            Self::Step => f.write_str("step"),
            Self::Speed(speed) => write!(f, "speed {speed}"),
            Self::HandOver(kind) => write!(f, "on to the {kind} clock"),
            Self::Stop => f.write_str("stop"),
        }
    }
}

/// Kind of clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ClockKind {
    /// Threads against the wall clock.
    Real,
    /// One thread, discrete-event time, bit-for-bit reproducible.
    Virtual,
}

impl ClockKind {
    /// Returns the other clock.
    pub fn other(self) -> Self {
        match self {
            Self::Real => Self::Virtual,
            Self::Virtual => Self::Real,
        }
    }
}

impl fmt::Display for ClockKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Real => "real",
            Self::Virtual => "virtual",
        })
    }
}

/// Speed of virtual time relative to wall time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Speed {
    /// As fast as the machine allows.
    #[serde(rename = "FlatOut")]
    Unlimited,
    /// Seconds of run time per second of wall time; see [`Speed::times`].
    Times(Pace),
}

impl Speed {
    /// Run time passes as fast as wall time.
    pub const REAL_TIME: Self = Self::Times(Pace(1.0));

    /// Returns a paced speed.
    ///
    /// # Errors
    /// [`SpeedError`] outside 0.1 to 100.
    pub fn times(factor: f64) -> Result<Self, SpeedError> {
        Pace::try_from(factor).map(Self::Times)
    }
}

impl fmt::Display for Speed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unlimited => f.write_str("flat out"),
            Self::Times(pace) => write!(f, "{}×", pace.0),
        }
    }
}

/// A factor between run time and wall time, validated by [`Speed::times`].
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct Pace(f64);

impl Pace {
    /// The slowest pace: ten seconds of wall time per second of run time.
    pub const MIN: f64 = 0.1;

    /// The fastest pace; for more, use [`Speed::Unlimited`].
    pub const MAX: f64 = 100.0;

    /// Seconds of run time per second of wall time.
    pub fn get(self) -> f64 {
        self.0
    }
}

impl TryFrom<f64> for Pace {
    type Error = SpeedError;

    fn try_from(factor: f64) -> Result<Self, SpeedError> {
        if (Self::MIN..=Self::MAX).contains(&factor) {
            Ok(Self(factor))
        } else {
            Err(SpeedError(factor))
        }
    }
}

impl From<Pace> for f64 {
    fn from(pace: Pace) -> Self {
        pace.0
    }
}

/// A factor that is not a valid speed.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[error(
    "{0} is not a speed: expected {min} to {max} times that of the wall's clock",
    min = Pace::MIN,
    max = Pace::MAX
)]
pub struct SpeedError(f64);

/// A command with the run time at which to give it.
///
/// It takes effect before any tick that is due at `at` or later, so a list of them
/// replays exactly.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimedCommand {
    /// Run time at which it takes effect.
    pub at: Time,
    /// The command.
    pub command: Command,
}

/// Why a graph refuses a setting, with a remedy.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum KnobRefusal {
    /// A name that the graph does not know.
    #[error("there is no {kind} {name:?}: {}", known_names(known))]
    Unknown {
        /// `node` or `topic`.
        kind: &'static str,
        /// The name.
        name: String,
        /// The known names.
        known: Vec<String>,
    },
    /// A node of another process.
    #[error("{0} runs in another process")]
    OtherProcess(String),
    /// A topic without readers, where others have some.
    #[error("{topic} has no reader: {}", topics_with_readers(read))]
    Unread {
        /// The topic.
        topic: String,
        /// The topics with readers.
        read: Vec<String>,
    },
    /// A setting of due times, of a node that messages trigger.
    #[error("messages trigger {0}: choose a node that ticks at a rate")]
    Triggered(String),
    /// A setting of a thread, of a node in an executor.
    #[error("{0} has no thread of its own: its executor decides when it starts")]
    NoThread(String),
    /// Durations of a file that is not loaded.
    #[error("the durations in {0} were not loaded: name a file that the command can read")]
    NotLoaded(String),
    /// A message that is published already.
    #[error("message {seq} is already published: choose {next} or a later one")]
    UnderWay {
        /// Its sequence number.
        seq: u64,
        /// The next sequence number.
        next: u64,
    },
    /// A setting that the node does without.
    #[error("{0}")]
    Fixed(&'static str),
    /// A setting of something else.
    #[error("{0} is not for a {1}")]
    NotFor(String, &'static str),
    /// The node refuses, in its own words.
    #[error("{0}")]
    ByNode(String),
}

fn known_names(known: &[String]) -> String {
    if known.is_empty() {
        "the graph has none".to_owned()
    } else {
        format!("expected one of {}", known.join(", "))
    }
}

fn topics_with_readers(read: &[String]) -> String {
    if read.is_empty() {
        "let a node read a topic first".to_owned()
    } else {
        format!("expected one of {}", read.join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_speed_out_of_range_is_refused_with_value_and_range() {
        let no_numbers = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1.0, f64::MAX];
        for wrong in no_numbers.into_iter().chain([0.0, 0.09, 100.1]) {
            let error = Speed::times(wrong).expect_err("refused").to_string();
            let expected = "is not a speed: expected 0.1 to 100 times that of the wall's clock";
            assert_eq!(error, format!("{wrong} {expected}"));
        }
        assert!(Speed::times(0.1).is_ok() && Speed::times(100.0).is_ok());
        assert_eq!(Speed::times(1.0), Ok(Speed::REAL_TIME));
    }
}

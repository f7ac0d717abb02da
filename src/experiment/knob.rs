//! What can be turned while an experiment runs, as lines of text.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::{ACTION, OBS};
use crate::{
    cartpole::{POLICY, SENSOR},
    policy::{PolicyError, PolicySpec, UnknownPolicy},
    runtime::{Command, Depth, DepthError, Hz, HzError, Time, TimedCommand, telemetry::Event},
};

/// One setting of one knob. As text: the knob's name and the value, such as
/// `control-hz 10`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Knob {
    /// How often the policy decides.
    ControlHz(Hz),
    /// How often the sensor publishes.
    SensorHz(Hz),
    /// How many messages `/obs` and `/action` keep.
    QueueDepth(Depth),
    /// The policy.
    Policy(PolicySpec),
}

impl Knob {
    /// The knob called `name`, with hyphens or underscores, set to `value`.
    ///
    /// # Errors
    /// [`KnobError`] if there is no such knob or it does not take the value.
    pub fn parse(name: &str, value: &str) -> Result<Self, KnobError> {
        match name.replace('_', "-").as_str() {
            "control-hz" => Ok(Self::ControlHz(value.parse()?)),
            "sensor-hz" => Ok(Self::SensorHz(value.parse()?)),
            "queue-depth" => Ok(Self::QueueDepth(value.parse()?)),
            "policy" => Ok(Self::Policy(value.parse()?)),
            _ => Err(KnobError::Name(name.to_owned())),
        }
    }

    /// The commands that turn it.
    pub fn commands(&self) -> Vec<Command> {
        let rate = |node: &str, hz| {
            let node = node.to_owned();
            vec![Command::SetRate { node, hz }]
        };
        match *self {
            Self::ControlHz(hz) => rate(POLICY, hz),
            Self::SensorHz(hz) => rate(SENSOR, hz),
            Self::Policy(ref policy) => vec![Command::Send {
                node: POLICY.to_owned(),
                text: policy.to_string(),
            }],
            Self::QueueDepth(depth) => [OBS, ACTION]
                .map(|topic| Command::SetDepth {
                    topic: topic.to_owned(),
                    depth,
                })
                .to_vec(),
        }
    }
}

impl fmt::Display for Knob {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ControlHz(hz) => write!(f, "control-hz {}", hz.get()),
            Self::SensorHz(hz) => write!(f, "sensor-hz {}", hz.get()),
            Self::QueueDepth(depth) => write!(f, "queue-depth {depth}"),
            Self::Policy(policy) => write!(f, "policy {policy}"),
        }
    }
}

impl Knob {
    /// The same setting and no other; see [`PolicySpec::pinned`].
    ///
    /// # Errors
    /// [`PolicyError`] if a policy cannot be had.
    pub fn pinned(self) -> Result<Self, PolicyError> {
        match self {
            Self::Policy(policy) => policy.pinned().map(Self::Policy),
            other => Ok(other),
        }
    }

    /// The policy that it brings, if it brings one.
    pub fn policy(&self) -> Option<&PolicySpec> {
        match self {
            Self::Policy(policy) => Some(policy),
            _ => None,
        }
    }

    /// The knob that `command` turns. Both topics' depths are one knob, which
    /// shows in the command for `/obs`.
    pub fn of(command: &Command) -> Option<Self> {
        match command {
            Command::SetRate { node, hz } if node == POLICY => Some(Self::ControlHz(*hz)),
            Command::SetRate { node, hz } if node == SENSOR => Some(Self::SensorHz(*hz)),
            Command::SetDepth { topic, depth } if topic == OBS => Some(Self::QueueDepth(*depth)),
            Command::Send { node, text } if node == POLICY => text.parse().ok().map(Self::Policy),
            _ => None,
        }
    }
}

/// A knob to be turned at a run time. As text: the seconds, then the knob,
/// such as `2.5 control-hz 10`. A `#` that would begin a comment is `\#`; see
/// [`parse_knobs`].
///
/// ```
/// use ratelab::experiment::{Knob, TimedKnob};
/// use ratelab::runtime::Hz;
///
/// let timed: TimedKnob = "2.5 control-hz 10".parse()?;
/// assert_eq!(timed.knob, Knob::ControlHz(Hz::new(10.0)?));
/// assert_eq!(timed.to_string(), "2.5 control-hz 10");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimedKnob {
    /// Run time at which it is turned, before any tick due then.
    pub at: Time,
    /// The new setting.
    pub knob: Knob,
}

impl TimedKnob {
    /// The same setting and no other; see [`PolicySpec::pinned`].
    ///
    /// # Errors
    /// [`PolicyError`] if a policy cannot be had.
    pub fn pinned(self) -> Result<Self, PolicyError> {
        let knob = self.knob.pinned()?;
        Ok(Self { knob, ..self })
    }

    /// The knob that was turned in a run, if `event` tells of one.
    pub fn of(event: &Event) -> Option<Self> {
        let TimedCommand { at, command } = event.replayable()?;
        let knob = Knob::of(&command)?;
        Some(Self { at, knob })
    }

    /// The commands that turn it then.
    pub fn commands(&self) -> Vec<TimedCommand> {
        let at = self.at;
        let commands = self.knob.commands().into_iter();
        commands
            .map(|command| TimedCommand { at, command })
            .collect()
    }
}

impl fmt::Display for TimedKnob {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let nanos = self.at.as_nanos();
        let decimals = format!("{:09}", nanos % 1_000_000_000);
        let decimals = decimals.trim_end_matches('0');
        let point = if decimals.is_empty() { "" } else { "." };
        let seconds = nanos / 1_000_000_000;
        let knob = escaped(&self.knob.to_string());
        write!(f, "{seconds}{point}{decimals} {knob}")
    }
}

impl FromStr for TimedKnob {
    type Err = KnobError;

    fn from_str(line: &str) -> Result<Self, KnobError> {
        let line = unescaped(line);
        let shape = || KnobError::Shape(line.trim().to_owned());
        let (at, knob) = first_word(&line).ok_or_else(shape)?;
        let (name, value) = first_word(knob).ok_or_else(shape)?;
        // Only a path may have spaces in it.
        if name != "policy" && value.contains(char::is_whitespace) {
            return Err(shape());
        }
        let seconds: f64 = at.parse().map_err(|_| KnobError::Time(at.to_owned()))?;
        let at = Time::from_secs_f64(seconds).map_err(|_| KnobError::Time(at.to_owned()))?;
        let knob = Knob::parse(name, value)?;
        Ok(Self { at, knob })
    }
}

/// The first word of `text` and all that follows, if something does.
fn first_word(text: &str) -> Option<(&str, &str)> {
    let (word, rest) = text.trim().split_once(char::is_whitespace)?;
    Some((word, rest.trim_start()))
}

/// Where comments begin in `line`, or would if it were not for backslashes before
/// the `#`: at its start and after white space. For each, its place and the number
/// of backslashes.
fn hashes(line: &str) -> impl Iterator<Item = (usize, usize)> {
    line.match_indices('#').filter_map(|(place, _)| {
        let before = line.get(..place).unwrap_or_default();
        let bare = before.trim_end_matches('\\');
        let begins = bare.is_empty() || bare.ends_with(char::is_whitespace);
        begins.then(|| (place, before.len() - bare.len()))
    })
}

/// `line` without its comment.
fn uncommented(line: &str) -> &str {
    let comment = hashes(line).find(|(_, backslashes)| *backslashes == 0);
    comment
        .and_then(|(place, _)| line.get(..place))
        .unwrap_or(line)
}

/// `text` with a backslash more before each `#` that would begin a comment.
fn escaped(text: &str) -> String {
    let mut escaped = text.to_owned();
    let places: Vec<usize> = hashes(text).map(|(place, _)| place).collect();
    for place in places.into_iter().rev() {
        escaped.insert(place, '\\');
    }
    escaped
}

/// `text` with a backslash less before each `#` that would begin a comment.
fn unescaped(text: &str) -> String {
    let mut unescaped = text.to_owned();
    let escapes = hashes(text).filter(|(_, backslashes)| *backslashes > 0);
    let places: Vec<usize> = escapes.map(|(place, _)| place - 1).collect();
    for place in places.into_iter().rev() {
        unescaped.remove(place);
    }
    unescaped
}

/// A line that turns no knob.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum KnobError {
    /// Not three words.
    #[error(
        "{0:?} is not a timed knob: expected seconds, knob and value, such as 2.5 control-hz 10"
    )]
    Shape(String),
    /// The first word is no time.
    #[error("{0:?} is not a time: expected seconds, zero or more")]
    Time(String),
    /// The second word is no knob.
    #[error("{0:?} is not a knob: expected control-hz, sensor-hz, queue-depth or policy")]
    Name(String),
    /// The value is no rate.
    #[error(transparent)]
    Rate(#[from] HzError),
    /// The value is no depth.
    #[error(transparent)]
    Depth(#[from] DepthError),
    /// The value is no policy.
    #[error(transparent)]
    Policy(#[from] UnknownPolicy),
    /// Where in a list the error is.
    #[error("line {line}: {error}")]
    Line {
        /// Line number, counted from one.
        line: usize,
        /// What is wrong with it.
        error: Box<KnobError>,
    },
}

/// Reads a list of timed knobs, one per line. Empty lines and comments do not
/// count: from a `#` at the start of a line or after white space to its end. In a
/// path such a `#` is written `\#`.
///
/// # Errors
/// [`KnobError::Line`] names the first line that is not understood.
pub fn parse_knobs(text: &str) -> Result<Vec<TimedKnob>, KnobError> {
    let lines = text
        .lines()
        .enumerate()
        .map(|(index, line)| (index + 1, uncommented(line).trim()));
    lines
        .filter(|(_, content)| !content.is_empty())
        .map(|(line, content)| {
            content.parse().map_err(|error| KnobError::Line {
                line,
                error: Box::new(error),
            })
        })
        .collect()
}

//! What can be turned on a running graph, as values and as lines of text.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::{
    depth::{Depth, DepthError},
    time::{Hz, HzError, Time},
};

/// One setting of one node or topic of a graph. As text `rate NODE HZ`,
/// `depth TOPIC N` or `send NODE TEXT`.
///
/// ```
/// use ratelab::runtime::{Hz, Knob};
///
/// let knob: Knob = "rate planner 10".parse()?;
/// assert_eq!(knob, Knob::Rate { node: "planner".to_owned(), hz: Hz::new(10.0)? });
/// assert_eq!(knob.to_string(), "rate planner 10");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Knob {
    /// How often a node ticks.
    #[serde(rename = "SetRate")]
    Rate {
        /// The node's name.
        node: String,
        /// Its rate.
        hz: Hz,
    },
    /// How many messages a topic keeps.
    #[serde(rename = "SetDepth")]
    Depth {
        /// The topic's name.
        topic: String,
        /// Its depth.
        depth: Depth,
    },
    /// A message to a node, which knows what to make of it; see
    /// [`Node::on_message`](super::Node::on_message).
    #[serde(rename = "Tell")]
    Send {
        /// The node's name.
        node: String,
        /// The message.
        #[serde(rename = "what")]
        text: String,
    },
}

/// The kinds of knobs, for those who list or complete them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KnobKind {
    /// [`Knob::Rate`].
    Rate,
    /// [`Knob::Depth`].
    Depth,
    /// [`Knob::Send`].
    Send,
}

impl KnobKind {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Rate, Self::Depth, Self::Send];

    /// The first word of such a knob.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rate => "rate",
            Self::Depth => "depth",
            Self::Send => "send",
        }
    }

    /// How such a knob is written.
    pub fn usage(self) -> &'static str {
        match self {
            Self::Rate => "rate NODE HZ",
            Self::Depth => "depth TOPIC N",
            Self::Send => "send NODE TEXT",
        }
    }

    /// What its value is, in usage texts.
    pub fn value_name(self) -> &'static str {
        match self {
            Self::Rate => "HZ",
            Self::Depth => "N",
            Self::Send => "TEXT",
        }
    }

    /// The knob of this kind on `target`, a node or a topic, set to `value`.
    ///
    /// # Errors
    /// [`KnobError`] if it does not take the value.
    pub fn set(self, target: &str, value: &str) -> Result<Knob, KnobError> {
        let target = target.to_owned();
        Ok(match self {
            Self::Rate => Knob::Rate {
                node: target,
                hz: value.parse()?,
            },
            Self::Depth => Knob::Depth {
                topic: target,
                depth: value.parse()?,
            },
            Self::Send => Knob::Send {
                node: target,
                text: value.to_owned(),
            },
        })
    }
}

impl Knob {
    /// Its kind.
    pub fn kind(&self) -> KnobKind {
        match self {
            Self::Rate { .. } => KnobKind::Rate,
            Self::Depth { .. } => KnobKind::Depth,
            Self::Send { .. } => KnobKind::Send,
        }
    }

    /// The node or the topic that it is of.
    pub fn target(&self) -> &str {
        match self {
            Self::Rate { node, .. } | Self::Send { node, .. } => node,
            Self::Depth { topic, .. } => topic,
        }
    }

    /// What it is set to.
    pub fn value(&self) -> String {
        match self {
            Self::Rate { hz, .. } => hz.get().to_string(),
            Self::Depth { depth, .. } => depth.to_string(),
            Self::Send { text, .. } => text.clone(),
        }
    }

    /// Whether `other` sets the same thing, to whatever value.
    pub fn is_of(&self, other: &Self) -> bool {
        self.kind() == other.kind() && self.target() == other.target()
    }
}

impl fmt::Display for Knob {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = self.kind().name();
        write!(f, "{kind} {} {}", self.target(), self.value())
    }
}

impl FromStr for Knob {
    type Err = KnobError;

    fn from_str(text: &str) -> Result<Self, KnobError> {
        let (name, rest) = first_word(text).ok_or_else(|| KnobError::Name(text.to_owned()))?;
        let kind = KnobKind::ALL.into_iter().find(|kind| kind.name() == name);
        let kind = kind.ok_or_else(|| KnobError::Name(name.to_owned()))?;
        let (target, value) = first_word(rest).ok_or_else(|| KnobError::Shape {
            text: text.trim().to_owned(),
            expected: kind.usage(),
        })?;
        // Only a message may have spaces in it.
        if kind != KnobKind::Send && value.contains(char::is_whitespace) {
            return Err(KnobError::Shape {
                text: text.trim().to_owned(),
                expected: kind.usage(),
            });
        }
        kind.set(target, value)
    }
}

/// The first word of `text` and all that follows, if something does.
pub(crate) fn first_word(text: &str) -> Option<(&str, &str)> {
    let (word, rest) = text.trim().split_once(char::is_whitespace)?;
    Some((word, rest.trim_start()))
}

/// A knob to be turned at a run time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimedKnob {
    /// Run time at which it is turned, before any tick due then.
    pub at: Time,
    /// The new setting.
    pub knob: Knob,
}

/// Text that is no knob.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum KnobError {
    /// Words are missing, or there are too many.
    #[error("{text:?} is not a knob: expected {expected}")]
    Shape {
        /// What was given.
        text: String,
        /// How it is written.
        expected: &'static str,
    },
    /// There is no knob of this name.
    #[error("{0:?} is not a knob: expected rate, depth or send")]
    Name(String),
    /// The value is no rate.
    #[error(transparent)]
    Rate(#[from] HzError),
    /// The value is no depth.
    #[error(transparent)]
    Depth(#[from] DepthError),
}

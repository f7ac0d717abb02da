//! The settings of a running graph, as values and as lines of text.

use std::{borrow::Cow, fmt, str::FromStr, time::Duration};

use serde::{Deserialize, Serialize};
use strum::{EnumDiscriminants, EnumMessage, VariantArray};
use thiserror::Error;

use super::millis;
use crate::{
    qos::{Depth, DepthError, ReadOrder},
    time::{Hz, HzError, Time},
};

/// A setting of a node or topic of a graph. As text `rate NODE HZ`, `depth TOPIC N`,
/// `send NODE TEXT` and so on; see [`KnobKind::usage`]. The value of an effect that has many
/// forms is text here: what it means is known to those who give the effect, such as
/// `crates/effects`.
///
/// ```
/// use ratelab::{Hz, Knob};
///
/// let knob: Knob = "rate planner 10".parse()?;
/// assert_eq!(knob, Knob::Rate { node: "planner".to_owned(), hz: Hz::new(10.0)? });
/// assert_eq!(knob.to_string(), "rate planner 10");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, EnumDiscriminants)]
#[strum_discriminants(
    name(KnobKind),
    derive(EnumMessage, VariantArray),
    doc = "The kinds of knobs, for lists and completion; each with the syntax of its text."
)]
pub enum Knob {
    /// Rate of a node.
    #[serde(rename = "SetRate")]
    #[strum_discriminants(strum(message = "rate NODE HZ"))]
    Rate {
        /// The node's name.
        node: String,
        /// Its rate.
        hz: Hz,
    },
    /// Queue depth of a topic.
    #[serde(rename = "SetDepth")]
    #[strum_discriminants(strum(message = "depth TOPIC N"))]
    Depth {
        /// The topic's name.
        topic: String,
        /// Its depth.
        depth: Depth,
    },
    /// A message to a node, which interprets it; see
    /// [`Node::on_message`](crate::Node::on_message).
    #[serde(rename = "Tell")]
    #[strum_discriminants(strum(message = "send NODE TEXT"))]
    Send {
        /// The node's name.
        node: String,
        /// The message.
        #[serde(rename = "what")]
        text: String,
    },
    /// A parameter of a node by its name; see
    /// [`Node::set_parameter`](crate::Node::set_parameter).
    #[strum_discriminants(strum(message = "set NODE NAME VALUE"))]
    Parameter {
        /// The node's name.
        node: String,
        /// The parameter's name.
        name: String,
        /// Its value, as text.
        value: String,
    },
    /// The duration of a node's ticks: a tick that starts at `s` reads at `s`, and
    /// publishes or applies its results at `s + cost`.
    #[strum_discriminants(strum(message = "takes NODE SPEC"))]
    Takes {
        /// The node's name.
        node: String,
        /// Their duration, as text.
        spec: String,
    },
    /// Offset of a node's due times from run time zero.
    #[strum_discriminants(strum(message = "offset NODE MS"))]
    Offset {
        /// The node's name.
        node: String,
        /// The offset.
        #[serde(rename = "ms", with = "millis")]
        offset: Duration,
    },
    /// Lateness of a node's ticks in virtual time.
    #[strum_discriminants(strum(message = "wakes NODE SPEC"))]
    Wakes {
        /// The node's name.
        node: String,
        /// The lateness, as text.
        spec: String,
    },
    /// The link from the publishers of a topic to its readers.
    #[strum_discriminants(strum(message = "link TOPIC SPEC"))]
    Link {
        /// The topic's name.
        topic: String,
        /// The link, as text.
        spec: String,
    },
    /// The read order of a topic.
    #[strum_discriminants(strum(message = "read TOPIC newest|oldest"))]
    Read {
        /// The topic's name.
        topic: String,
        /// The order.
        order: ReadOrder,
    },
    /// Loss of one message of a topic.
    #[strum_discriminants(strum(message = "lose TOPIC N"))]
    Lose {
        /// The topic's name.
        topic: String,
        /// The message's sequence number.
        seq: u64,
    },
    /// Extra delay of one message of a topic.
    #[strum_discriminants(strum(message = "postpone TOPIC N MS"))]
    Postpone {
        /// The topic's name.
        topic: String,
        /// The message's sequence number.
        seq: u64,
        /// The delay.
        #[serde(rename = "ms", with = "millis")]
        delay: Duration,
    },
    /// A node stops ticking; messages it has not released are lost.
    #[strum_discriminants(strum(message = "crash NODE"))]
    Crash {
        /// The node's name.
        node: String,
    },
    /// A node starts again from its initial state; see
    /// [`Node::restart`](crate::Node::restart).
    #[strum_discriminants(strum(message = "restart NODE"))]
    Restart {
        /// The node's name.
        node: String,
    },
    /// Duration of a node's next tick, in place of the usual one.
    #[strum_discriminants(strum(message = "hang NODE MS"))]
    Hang {
        /// The node's name.
        node: String,
        /// The duration.
        #[serde(rename = "ms", with = "millis")]
        cost: Duration,
    },
    /// Error of a node's own clock from now on: due times and stamps follow this clock.
    #[strum_discriminants(strum(message = "clock NODE OFFSET_MS DRIFT_PPM"))]
    Clock {
        /// The node's name.
        node: String,
        /// The error, as text.
        error: String,
    },
}

impl KnobKind {
    /// All kinds.
    pub const ALL: [Self; Self::VARIANTS.len()] = *Self::VARIANTS.first_chunk().expect("all");

    /// The syntax of the knob's text: its name, whose it is, and its value.
    pub fn usage(self) -> &'static str {
        self.get_message().unwrap_or_default()
    }

    fn word(self, number: usize) -> &'static str {
        self.usage().splitn(3, ' ').nth(number).unwrap_or_default()
    }

    /// The first word of the knob's text.
    pub fn name(self) -> &'static str {
        self.word(0)
    }

    /// The placeholder for its value in usage texts.
    pub fn value_name(self) -> &'static str {
        self.word(2)
    }

    /// Whether its value may contain spaces.
    pub fn takes_words(self) -> bool {
        matches!(
            self,
            Self::Send
                | Self::Parameter
                | Self::Takes
                | Self::Wakes
                | Self::Link
                | Self::Postpone
                | Self::Clock
        )
    }

    /// Whether the knob belongs to a topic; otherwise it belongs to a node.
    pub fn is_of_topic(self) -> bool {
        self.word(1) == "TOPIC"
    }

    /// Whether the knob is an event, without a value.
    pub fn has_no_value(self) -> bool {
        self.value_name().is_empty()
    }

    fn refused(self, target: &str, value: &str) -> KnobError {
        KnobError::Shape {
            text: format!("{} {target} {value}", self.name()),
            expected: self.usage(),
        }
    }

    /// Parses a knob for one message of `topic`: the sequence number, and the delay of a
    /// postponed message.
    fn set_message(self, topic: &str, value: &str) -> Result<Knob, KnobError> {
        let refused = || self.refused(topic, value);
        let whole = |text: &str| text.parse().map_err(|_| refused());
        let topic = topic.to_owned();
        if self == Self::Lose {
            let seq = whole(value)?;
            return Ok(Knob::Lose { topic, seq });
        }
        let (seq, delay) = first_word(value).ok_or_else(refused)?;
        Ok(Knob::Postpone {
            seq: whole(seq)?,
            delay: millis::parse(delay).map_err(KnobError::Value)?,
            topic,
        })
    }

    /// Parses a parameter: node, name and value.
    fn set_parameter(self, node: &str, text: &str) -> Result<Knob, KnobError> {
        let words = first_word(text).filter(|(_, value)| !value.is_empty());
        let (name, value) = words.ok_or_else(|| self.refused(node, text))?;
        Ok(Knob::Parameter {
            node: node.to_owned(),
            name: name.to_owned(),
            value: value.to_owned(),
        })
    }

    /// Returns the knob of this kind for `target`, set to `value`: a node, a topic, or
    /// the [subject](Knob::subject) of a knob.
    ///
    /// # Errors
    /// [`KnobError`] if the value is invalid for it.
    pub fn set(self, target: &str, value: &str) -> Result<Knob, KnobError> {
        if self.has_no_value() && !value.is_empty() {
            return Err(self.refused(target, value));
        }
        if let (Self::Parameter, Some((node, name))) = (self, first_word(target)) {
            return self.set_parameter(node, &format!("{name} {value}"));
        }
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
            Self::Parameter => return self.set_parameter(&target, value),
            Self::Takes => Knob::Takes {
                node: target,
                spec: value.to_owned(),
            },
            Self::Offset => Knob::Offset {
                node: target,
                offset: millis::parse(value).map_err(KnobError::Value)?,
            },
            Self::Wakes => Knob::Wakes {
                node: target,
                spec: value.to_owned(),
            },
            Self::Link => Knob::Link {
                topic: target,
                spec: value.to_owned(),
            },
            Self::Read => Knob::Read {
                topic: target,
                order: value.parse().map_err(KnobError::Value)?,
            },
            Self::Lose | Self::Postpone => return self.set_message(&target, value),
            Self::Crash => Knob::Crash { node: target },
            Self::Restart => Knob::Restart { node: target },
            Self::Hang => Knob::Hang {
                node: target,
                cost: millis::parse(value).map_err(KnobError::Value)?,
            },
            Self::Clock => Knob::Clock {
                node: target,
                error: value.to_owned(),
            },
        })
    }
}

impl Knob {
    /// The reason for its refusal in a graph whose kit lacks it.
    pub(crate) fn not_in_kit(&self) -> String {
        let name = self.kind().name();
        format!("this graph has no {name}: build it with the kit of crates/effects")
    }

    /// Kind of the knob.
    pub fn kind(&self) -> KnobKind {
        self.into()
    }

    /// Name of its node or topic.
    pub fn target(&self) -> &str {
        match self {
            Self::Depth { topic, .. }
            | Self::Link { topic, .. }
            | Self::Read { topic, .. }
            | Self::Lose { topic, .. }
            | Self::Postpone { topic, .. } => topic,
            Self::Rate { node, .. }
            | Self::Send { node, .. }
            | Self::Parameter { node, .. }
            | Self::Takes { node, .. }
            | Self::Offset { node, .. }
            | Self::Wakes { node, .. }
            | Self::Crash { node }
            | Self::Restart { node }
            | Self::Hang { node, .. }
            | Self::Clock { node, .. } => node,
        }
    }

    /// What it sets: its node or topic, with the name of a parameter.
    pub fn subject(&self) -> Cow<'_, str> {
        match self {
            Self::Parameter { node, name, .. } => format!("{node} {name}").into(),
            _ => self.target().into(),
        }
    }

    /// Its value as text.
    pub fn value(&self) -> String {
        match self {
            Self::Rate { hz, .. } => hz.get().to_string(),
            Self::Depth { depth, .. } => depth.to_string(),
            Self::Send { text, .. } => text.clone(),
            Self::Parameter { value, .. } => value.clone(),
            Self::Takes { spec, .. } | Self::Wakes { spec, .. } | Self::Link { spec, .. } => {
                spec.clone()
            }
            Self::Offset { offset, .. } => millis::to_millis(*offset).to_string(),
            Self::Read { order, .. } => order.to_string(),
            Self::Lose { seq, .. } => seq.to_string(),
            Self::Postpone { seq, delay, .. } => format!("{seq} {}", millis::to_millis(*delay)),
            Self::Crash { .. } | Self::Restart { .. } => String::new(),
            Self::Hang { cost, .. } => millis::to_millis(*cost).to_string(),
            Self::Clock { error, .. } => error.clone(),
        }
    }

    /// Whether `other` changes the same setting, to any value.
    pub fn is_of(&self, other: &Self) -> bool {
        let same = self.kind() == other.kind() && self.subject() == other.subject();
        same && self.message() == other.message()
    }

    /// Sequence number of its message, for a knob of a single message.
    pub(crate) fn message(&self) -> Option<u64> {
        match self {
            Self::Lose { seq, .. } | Self::Postpone { seq, .. } => Some(*seq),
            _ => None,
        }
    }
}

impl fmt::Display for Knob {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = self.kind();
        write!(f, "{} {}", kind.name(), self.subject())?;
        match kind.has_no_value() {
            true => Ok(()),
            false => write!(f, " {}", self.value()),
        }
    }
}

impl FromStr for Knob {
    type Err = KnobError;

    fn from_str(text: &str) -> Result<Self, KnobError> {
        let (name, rest) = first_word(text).unwrap_or((text.trim(), ""));
        let kind = KnobKind::ALL.into_iter().find(|kind| kind.name() == name);
        let kind = kind.ok_or_else(|| KnobError::Name(name.to_owned()))?;
        let alone = kind.has_no_value() && !rest.is_empty();
        let words = first_word(rest).or(alone.then_some((rest, "")));
        let (target, value) = words.ok_or_else(|| KnobError::Shape {
            text: text.trim().to_owned(),
            expected: kind.usage(),
        })?;
        if !kind.takes_words() && value.contains(char::is_whitespace) {
            return Err(KnobError::Shape {
                text: text.trim().to_owned(),
                expected: kind.usage(),
            });
        }
        kind.set(target, value)
    }
}

/// The possible first words of a knob.
fn names() -> String {
    let [first @ .., last] = KnobKind::ALL.map(KnobKind::name);
    format!("{} or {last}", first.join(", "))
}

/// The first word of `text` and the rest, if there is a rest.
fn first_word(text: &str) -> Option<(&str, &str)> {
    let (word, rest) = text.trim().split_once(char::is_whitespace)?;
    Some((word, rest.trim_start()))
}

/// A change of a knob at a run time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimedKnob {
    /// Run time of the change, before any tick due then.
    pub at: Time,
    /// The new setting.
    pub knob: Knob,
}

/// Text that is not a valid knob.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum KnobError {
    /// Missing or superfluous words.
    #[error("{text:?} is not a knob: expected {expected}")]
    Shape {
        /// The given text.
        text: String,
        /// The expected syntax.
        expected: &'static str,
    },
    /// An unknown knob.
    #[error("{0:?} is not a knob: expected {known}", known = names())]
    Name(String),
    /// An invalid rate.
    #[error(transparent)]
    Rate(#[from] HzError),
    /// An invalid queue depth.
    #[error(transparent)]
    Depth(#[from] DepthError),
    /// An invalid value, with the reason.
    #[error("{0}")]
    Value(String),
}

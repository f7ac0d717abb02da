//! The settings of a running graph, as values and as lines of text.

use std::{borrow::Cow, fmt, str::FromStr, time::Duration};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::knob_part::KnobPart;
use crate::{
    millis,
    qos::{Depth, ReadOrder},
    settings::{
        as_text,
        draw::{Cost, Draw},
        error::alternatives,
        link::Link,
        local_clock::ClockError,
        release::Overrun,
    },
    time::{Hz, Time},
};

/// Makes [`Knob`] and [`KnobKind`] of a table, a row for each knob: its documentation, its name,
/// the syntax of its text, the unit that its value is `in`, the [`TickTiming`] that it sets, and
/// its fields. The first field is whose it is. The others are its value, a word of the text each;
/// the last one is the rest of the text.
macro_rules! knobs {
    ($(
        $(#[$about:meta])*
        $name:ident = $usage:literal $(in $unit:literal)? $(sets $timing:ident)? {
            $(#[$about_target:meta])* $target:ident: String,
            $($(#[$about_field:meta])* $field:ident: $type:ty,)*
        }
    )+) => {
        /// A setting of a node or topic of a graph. As text `rate NODE HZ`, `depth TOPIC N`,
        /// `send NODE TEXT` and so on; see [`KnobKind::usage`].
        ///
        /// ```
        /// use ratelab::{Hz, Knob};
        ///
        /// let knob: Knob = "rate planner 10".parse()?;
        /// assert_eq!(knob, Knob::Rate { node: "planner".to_owned(), hz: Hz::new(10.0)? });
        /// assert_eq!(knob.to_string(), "rate planner 10");
        /// # Ok::<(), Box<dyn std::error::Error>>(())
        /// ```
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        pub enum Knob {
            $(
                $(#[$about])*
                $name {
                    $(#[$about_target])* $target: String,
                    $($(#[$about_field])* $field: $type,)*
                },
            )+
        }

        /// The kinds of knobs, for lists and completion; each with the syntax of its text.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum KnobKind {
            $(#[doc = concat!("`", $usage, "`")] $name,)+
        }

        impl KnobKind {
            /// All kinds.
            pub const ALL: [Self; [$($usage),+].len()] = [$(Self::$name),+];

            /// Returns the syntax of the knob's text: its name, whose it is, and its value.
            pub fn usage(self) -> &'static str {
                match self {
                    $(Self::$name => $usage,)+
                }
            }

            /// Returns the unit after a number of its value, with a blank before it; empty if it
            /// has none.
            pub fn unit(self) -> &'static str {
                match self {
                    $(Self::$name => concat!($(" ", $unit)?),)+
                }
            }

            /// Returns whether it sets this of the ticks of its node.
            pub fn sets(self, timing: TickTiming) -> bool {
                match self {
                    $(Self::$name => [$(TickTiming::$timing)?].contains(&timing),)+
                }
            }

            /// Returns whether the knob belongs to a topic; otherwise it belongs to a node.
            pub fn is_of_topic(self) -> bool {
                let target = match self {
                    $(Self::$name => stringify!($target),)+
                };
                target == "topic"
            }

            /// For each part of its value whether it may contain spaces.
            fn parts(self) -> &'static [bool] {
                match self {
                    $(Self::$name => &[$(<$type>::IS_TEXT),*],)+
                }
            }

            /// Returns the knob of this kind for `target`, with the parts of its value.
            #[allow(unused_mut, unused_variables, reason = "some knobs have no value")]
            fn with(self, target: String, mut parts: Parts<'_>) -> Result<Knob, KnobError> {
                Ok(match self {
                    $(Self::$name => Knob::$name {
                        $target: target,
                        $($field: parts.next()?,)*
                    },)+
                })
            }
        }

        impl Knob {
            /// Kind of the knob.
            pub fn kind(&self) -> KnobKind {
                match self {
                    $(Self::$name { .. } => KnobKind::$name,)+
                }
            }

            /// Returns the name of its node or topic.
            pub fn target(&self) -> &str {
                match self {
                    $(Self::$name { $target, .. } => $target,)+
                }
            }

            /// Returns the parts of its value as text.
            fn texts(&self) -> Vec<String> {
                match self {
                    $(Self::$name { $($field,)* .. } => vec![$($field.to_text()),*],)+
                }
            }
        }
    };
}

/// What a knob sets of the time of a node's ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TickTiming {
    /// When they are due.
    Due,
    /// How late they start after that in virtual time; the wall clock has a lateness of its own.
    Start,
    /// How long they take.
    Duration,
}

knobs! {
    /// Rate of a node.
    #[serde(rename = "SetRate")]
    Rate = "rate NODE HZ" in "Hz" sets Due {
        /// The node's name.
        node: String,
        /// Its rate.
        hz: Hz,
    }
    /// Queue depth of a topic.
    #[serde(rename = "SetDepth")]
    Depth = "depth TOPIC N" {
        /// The topic's name.
        topic: String,
        /// Its depth.
        depth: Depth,
    }
    /// A message to a node, which interprets it; see
    /// [`Node::on_order`](crate::Node::on_order).
    #[serde(rename = "Tell")]
    Send = "send NODE TEXT" {
        /// The node's name.
        node: String,
        /// The message.
        #[serde(rename = "what")]
        text: String,
    }
    /// A parameter of a node by its name; see
    /// [`Node::set_parameter`](crate::Node::set_parameter).
    Parameter = "set NODE NAME VALUE" {
        /// The node's name.
        node: String,
        /// The parameter's name.
        name: String,
        /// Its value, as text.
        value: String,
    }
    /// The duration of a node's ticks: a tick that starts at `s` reads at `s`, and
    /// publishes or applies its results at `s + cost`.
    Takes = "takes NODE SPEC" in "ms" sets Duration {
        /// The node's name.
        node: String,
        /// Their duration.
        #[serde(rename = "spec", with = "as_text")]
        cost: Cost,
    }
    /// Offset of a node's due times from run time zero.
    Offset = "offset NODE MS" in "ms" sets Due {
        /// The node's name.
        node: String,
        /// The offset.
        #[serde(rename = "ms", with = "millis")]
        offset: Duration,
    }
    /// Lateness of a node's ticks in virtual time.
    Wakes = "wakes NODE SPEC" in "ms" sets Start {
        /// The node's name.
        node: String,
        /// The lateness.
        #[serde(rename = "spec", with = "as_text")]
        lateness: Draw,
    }
    /// What becomes of a node's due times that pass while it is busy.
    Late = "late NODE skip|catch-up|queue:N" {
        /// The node's name.
        node: String,
        /// What becomes of them.
        #[serde(rename = "spec", with = "as_text")]
        overrun: Overrun,
    }
    /// The link from the publishers of a topic to its readers.
    Link = "link TOPIC SPEC" {
        /// The topic's name.
        topic: String,
        /// The link.
        #[serde(rename = "spec", with = "as_text")]
        link: Link,
    }
    /// The read order of a topic.
    Read = "read TOPIC newest|oldest" {
        /// The topic's name.
        topic: String,
        /// The order.
        order: ReadOrder,
    }
    /// Loss of one message of a topic.
    Lose = "lose TOPIC N" {
        /// The topic's name.
        topic: String,
        /// The message's sequence number.
        seq: u64,
    }
    /// Extra delay of one message of a topic.
    Postpone = "postpone TOPIC N MS" {
        /// The topic's name.
        topic: String,
        /// The message's sequence number.
        seq: u64,
        /// The delay.
        #[serde(rename = "ms", with = "millis")]
        delay: Duration,
    }
    /// A node stops ticking; messages that it holds back are lost.
    Crash = "crash NODE" {
        /// The node's name.
        node: String,
    }
    /// A node starts again from its initial state; see
    /// [`Node::restart`](crate::Node::restart).
    Restart = "restart NODE" {
        /// The node's name.
        node: String,
    }
    /// Duration of a node's next tick, in place of the usual one.
    Hang = "hang NODE MS" in "ms" sets Duration {
        /// The node's name.
        node: String,
        /// The duration.
        #[serde(rename = "ms", with = "millis")]
        cost: Duration,
    }
    /// Error of a node's own clock from now on: due times and stamps follow this clock.
    Clock = "clock NODE OFFSET_MS DRIFT_PPM [STEP_MS]" sets Due {
        /// The node's name.
        node: String,
        /// The error.
        #[serde(with = "as_text")]
        error: ClockError,
    }
    /// Error of the clock that a node stamps by from now on, whatever clock its ticks follow.
    StampClock = "stamp_clock NODE OFFSET_MS DRIFT_PPM [STEP_MS]" {
        /// The node's name.
        node: String,
        /// The error.
        #[serde(with = "as_text")]
        error: ClockError,
    }
}

impl KnobKind {
    fn word(self, number: usize) -> &'static str {
        self.usage().splitn(3, ' ').nth(number).unwrap_or_default()
    }

    /// Returns the first word of the knob's text.
    pub fn name(self) -> &'static str {
        self.word(0)
    }

    /// Returns the placeholder for its value in usage texts.
    pub fn value_name(self) -> &'static str {
        self.word(2)
    }

    /// Returns whether its value may contain spaces.
    pub fn takes_words(self) -> bool {
        matches!(self.parts(), [true] | [_, _, ..])
    }

    /// Returns whether its value is a time, or a draw of one.
    pub fn is_time(self) -> bool {
        self.unit() == " ms"
    }

    /// Returns whether its value is a text for random times, such as `60..110`.
    pub fn is_drawn(self) -> bool {
        self.is_time() && self.takes_words()
    }

    /// Returns whether the schedule of a node obeys it; the others are of a topic, or the node
    /// itself obeys them.
    pub fn is_of_schedule(self) -> bool {
        !self.is_of_topic() && !matches!(self, Self::Send | Self::Parameter)
    }

    /// Returns whether the knob is an event, without a value.
    pub fn has_no_value(self) -> bool {
        self.parts().is_empty()
    }

    /// Returns the knob of this kind for `target`, set to `value`: a node, a topic, or
    /// the [subject](Knob::subject) of a knob.
    ///
    /// # Errors
    /// [`KnobError`] if the value is invalid for it.
    pub fn set(self, target: &str, value: &str) -> Result<Knob, KnobError> {
        if let (Self::Parameter, Some((node, name))) = (self, first_word(target)) {
            return self.set(node, &format!("{name} {value}"));
        }
        let refused = self.refused(&format!("{} {target} {value}", self.name()));
        if self.has_no_value() && !value.is_empty() {
            return Err(refused);
        }
        let parts = Parts {
            left: self.parts().len(),
            rest: value,
            refused,
        };
        self.with(target.to_owned(), parts)
    }

    /// Returns the error for a text without the parts of this kind.
    fn refused(self, text: &str) -> KnobError {
        let (text, expected) = (text.to_owned(), self.usage());
        KnobError::Shape { text, expected }
    }
}

/// The parts of a value in its text that are not read yet.
struct Parts<'a> {
    left: usize,
    rest: &'a str,
    /// The error for a text without them.
    refused: KnobError,
}

impl Parts<'_> {
    fn next<P: KnobPart>(&mut self) -> Result<P, KnobError> {
        self.left = self.left.saturating_sub(1);
        let (part, rest) = if self.left == 0 {
            (self.rest, "")
        } else {
            first_word(self.rest).ok_or_else(|| self.refused.clone())?
        };
        self.rest = rest;
        let refused = || self.refused.clone();
        P::read(part).map_err(|error| error.map_or_else(refused, KnobError::Value))
    }
}

impl Knob {
    /// Returns the random duration that it sets: what a tick takes, how late it starts, the delay
    /// of a link.
    pub fn draw(&self) -> Option<&Draw> {
        match self {
            Self::Link { link, .. } => Some(&link.delay),
            Self::Takes { cost, .. } => Some(&cost.draw),
            Self::Wakes { lateness, .. } => Some(lateness),
            _ => None,
        }
    }

    /// Returns the same knob with another random duration, of a knob that sets one.
    #[must_use]
    pub fn with_draw(mut self, draw: Draw) -> Self {
        match &mut self {
            Self::Link { link, .. } => link.delay = draw,
            Self::Takes { cost, .. } => cost.draw = draw,
            Self::Wakes { lateness, .. } => *lateness = draw,
            _ => {}
        }
        self
    }

    /// Returns whether it makes all ticks of its node take time.
    pub fn takes_time(&self) -> bool {
        matches!(self, Self::Takes { cost, .. } if !cost.draw.is_none())
    }

    /// Returns what it sets: its node or topic, with the name of a parameter.
    pub fn subject(&self) -> Cow<'_, str> {
        match self {
            Self::Parameter { node, name, .. } => format!("{node} {name}").into(),
            _ => self.target().into(),
        }
    }

    /// Returns its value as text.
    pub fn value(&self) -> String {
        match self {
            Self::Parameter { value, .. } => value.clone(),
            _ => self.texts().join(" "),
        }
    }

    /// Returns the value `before` this knob was set, as the log of a run has it; `before` is the
    /// knob that sets it again.
    pub(crate) fn replaced(&self, before: &Self) -> String {
        match before {
            _ if matches!(self, Self::Lose { .. }) => "not lost".to_owned(),
            Self::Crash { .. } => "crashed".to_owned(),
            Self::Restart { .. } => "running".to_owned(),
            Self::Send { text, .. } => text.clone(),
            Self::Rate { hz, .. } => hz.to_string(),
            Self::Offset { offset: ms, .. } | Self::Postpone { delay: ms, .. } => {
                format!("{} ms", millis::to_millis(*ms))
            }
            before => before.value(),
        }
    }

    /// Returns whether `other` changes the same setting, to any value.
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
        if kind.has_no_value() {
            Ok(())
        } else {
            write!(f, " {}", self.value())
        }
    }
}

impl FromStr for Knob {
    type Err = KnobError;

    fn from_str(text: &str) -> Result<Self, KnobError> {
        let (name, rest) = first_word(text).unwrap_or((text.trim(), ""));
        let kind = KnobKind::ALL
            .into_iter()
            .find(|kind| kind.name() == name)
            .ok_or_else(|| KnobError::Name(name.to_owned()))?;
        let refused = || kind.refused(text.trim());
        let alone = kind.has_no_value() && !rest.is_empty();
        let words = first_word(rest).or(alone.then_some((rest, "")));
        let (target, value) = words.ok_or_else(refused)?;
        if !kind.takes_words() && value.contains(char::is_whitespace) {
            return Err(refused());
        }
        kind.set(target, value)
    }
}

/// Returns the possible first words of a knob.
fn names() -> String {
    alternatives(&KnobKind::ALL.map(KnobKind::name))
}

/// Returns the first word of `text` and the rest, if there is a rest.
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
    /// An invalid value, with the reason.
    #[error("{0}")]
    Value(String),
}

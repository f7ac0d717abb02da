//! How messages of several topics are combined.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};

use crate::runtime::depth::Depth;

/// How the messages of the topics that trigger a node become the inputs of its ticks. With
/// one topic all are the same: every message is the input of a tick.
///
/// The last follows `message_filters` 6.0.6 (`361e42c`), in which messages are compared
/// by the stamp of their header. Here that is the run time of the sensing
/// ([`Message::sensed`](crate::runtime::Message::sensed)), which robot software hands on
/// in the header.
///
/// As text `each` or `exact:10`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Match {
    /// The newest from each: a tick as soon as all topics had one since the tick before.
    #[default]
    Each,
    /// Messages with the same stamp (`exact_time.hpp`, `ExactTime`).
    Exact {
        /// Number of stamps that wait for the rest of their set.
        queue: Depth,
    },
}

/// The accepted texts.
const EXPECTED: &str = "expected each or exact:QUEUE";

impl fmt::Display for Match {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Each => f.write_str("each"),
            Self::Exact { queue } => write!(f, "exact:{queue}"),
        }
    }
}

impl FromStr for Match {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let refusal = |why: String| format!("{text:?} is no way to match messages: {why}");
        let queue = |text: &str| text.parse().map_err(|error| refusal(format!("{error}")));
        match text.trim().split_once(':') {
            None if text.trim() == "each" => Ok(Self::Each),
            Some(("exact", rest)) => Ok(Self::Exact {
                queue: queue(rest)?,
            }),
            _ => Err(refusal(EXPECTED.to_owned())),
        }
    }
}

impl TryFrom<String> for Match {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<Match> for String {
    fn from(matching: Match) -> Self {
        matching.to_string()
    }
}

//! How messages of several topics are combined.

use std::{fmt, str::FromStr, time::Duration};

use super::error::SettingError;
use crate::{millis, qos::Depth};

/// How the messages of the topics that trigger a node become the inputs of its ticks. With
/// one topic all are the same: every message is the input of a tick.
///
/// The last two follow `message_filters` 6.0.6 (`361e42c`), in which messages are compared
/// by the stamp of their header: here [`Message::sensed`](crate::Message::sensed), which a wrong
/// clock may have stamped.
///
/// As text `each`, `every:3`, `exact:10`, `approximate:10`, or `approximate:10:2.5` with an interval in
/// milliseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Match {
    /// The newest from each: a tick as soon as all topics had one since the tick before.
    #[default]
    Each,
    /// As [`Each`](Self::Each), but only the first of so many sets makes a tick.
    Every {
        /// The number of sets.
        sets: Depth,
    },
    /// Messages with the same stamp (`exact_time.hpp`, `ExactTime`).
    Exact {
        /// Number of stamps that wait for the rest of their set.
        queue: Depth,
    },
    /// Messages with the closest stamps, each in one set at most (`approximate_time.hpp`,
    /// `ApproximateTime` with its default age penalty, 0.1).
    Approximate {
        /// Number of messages of a topic that wait for the rest of their set.
        queue: Depth,
        /// The longest interval between the stamps of a set; [`Duration::MAX`] for any.
        interval: Duration,
    },
}

impl Match {
    /// Returns whether it is [`Each`](Self::Each).
    pub(crate) fn is_each(&self) -> bool {
        *self == Self::Each
    }
}

impl fmt::Display for Match {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Each => f.write_str("each"),
            Self::Every { sets } => write!(f, "every:{sets}"),
            Self::Exact { queue } => write!(f, "exact:{queue}"),
            Self::Approximate { queue, interval } => {
                write!(f, "approximate:{queue}")?;
                match *interval {
                    Duration::MAX => Ok(()),
                    interval => write!(f, ":{}", millis::to_millis(interval)),
                }
            }
        }
    }
}

impl FromStr for Match {
    type Err = SettingError;

    fn from_str(text: &str) -> Result<Self, SettingError> {
        let queue = |part: &str| {
            let refusal = |error| SettingError::MatchQueue(text.to_owned(), error);
            part.parse().map_err(refusal)
        };
        let interval = |part: &str| {
            let refusal = |error| SettingError::MatchInterval(text.to_owned(), error);
            millis::parse(part).map_err(refusal)
        };
        let parts: Vec<&str> = text.trim().split(':').collect();
        match parts[..] {
            ["each"] => Ok(Self::Each),
            ["every", rest] => Ok(Self::Every { sets: queue(rest)? }),
            ["exact", rest] => Ok(Self::Exact {
                queue: queue(rest)?,
            }),
            ["approximate", rest] => Ok(Self::Approximate {
                queue: queue(rest)?,
                interval: Duration::MAX,
            }),
            ["approximate", rest, ms] => Ok(Self::Approximate {
                queue: queue(rest)?,
                interval: interval(ms)?,
            }),
            _ => Err(SettingError::Match(text.to_owned())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invalid_intervals_of_approximate_time_are_refused() {
        for numbers in ["", ":0", ":5:-1", ":5:x", ":5:1:1"] {
            let text = format!("approximate{numbers}");
            let error = text.parse::<Match>().expect_err(&text);
            assert!(
                error
                    .to_string()
                    .contains("is not a way to match messages: "),
                "{error}"
            );
        }
    }
}

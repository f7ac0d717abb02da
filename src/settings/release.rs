//! When a node ticks: at a rate or on messages, how those of several topics are combined, and what
//! becomes of due times that pass while it is busy.

use std::{fmt, str::FromStr, time::Duration};

use super::error::SettingError;
use crate::{
    millis,
    qos::Depth,
    time::{Hz, HzError},
};

/// When a node ticks: at a rate, or when messages arrive.
///
/// | | at a rate | on messages |
/// |---|---|---|
/// | a tick is due | at `offset + k / f` | when the message arrives that completes its inputs |
/// | lateness | start − due | start − due: the wait behind earlier messages and for the executor |
/// | response time | end − due | end − due |
/// | still busy when due | an overrun: the tick is skipped | the message waits in the queue of its topic |
/// | loss | counted as overruns of the node | a full queue drops its oldest: a drop of the topic |
///
/// ```
/// use ratelab::{Clock, Depth, Graph, Hz, Inbox, Match, Tick, Time, Topic, VirtualClock};
///
/// let image = Topic::new("/image", Depth::ONE);
/// let mut graph = Graph::new();
/// graph.node("camera", Hz::new(30.0)?, 0, |wiring| {
///     let image = wiring.publisher(&image);
///     move |tick: &mut Tick| tick.publish(&image, ())
/// })?;
/// let detected = Topic::new("/detected", Depth::ONE);
/// graph.node("detector", Match::Each, 1, |wiring| {
///     let (mut image, detected) = (wiring.trigger(&image), wiring.publisher(&detected));
///     move |tick: &mut Tick| {
///         let image = tick.read(&mut image).expect("the image that arrived");
///         assert_eq!(image.stamp, tick.now());
///         tick.publish(&detected, ());
///     }
/// })?;
/// let end = Time::from_secs_f64(1.0)?;
/// VirtualClock.run(&mut graph, &mut Inbox::default(), end)?;
/// assert_eq!(detected.published(), 31);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Release {
    /// At a rate.
    AtRate(Hz),
    /// When a message has arrived on each topic that
    /// [triggers](crate::Wiring::trigger) the node.
    On(Match),
}

impl Release {
    /// Returns the matching of its triggers.
    pub(crate) fn matching(&self) -> Match {
        match self {
            Self::AtRate(_) => Match::Each,
            Self::On(matching) => *matching,
        }
    }

    /// Returns the rate; the lowest one for a node that has no use for it.
    pub(crate) fn hz(&self) -> Hz {
        match self {
            Self::AtRate(hz) => *hz,
            Self::On(_) => Hz::MIN,
        }
    }
}

impl TryFrom<f64> for Release {
    type Error = HzError;

    fn try_from(hz: f64) -> Result<Self, HzError> {
        Hz::new(hz).map(Self::AtRate)
    }
}

impl From<Hz> for Release {
    fn from(hz: Hz) -> Self {
        Self::AtRate(hz)
    }
}

impl From<Match> for Release {
    fn from(matching: Match) -> Self {
        Self::On(matching)
    }
}

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

/// The name of each policy in text; `queue:N` has the number behind it.
const SKIP: &str = "skip";
const CATCH_UP: &str = "catch-up";
const QUEUE: &str = "queue:";

/// What becomes of due times that pass while a node is busy.
///
/// | text | due times that have passed | as |
/// |---|---|---|
/// | `skip` | are overruns | a timer of ROS |
/// | `queue:N` | wait for up to N periods; earlier ones are overruns | a timer with a queue |
/// | `catch-up` | all wait, and then follow without a pause | a loop that sleeps until the next of its due times |
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Overrun {
    /// For how many periods a due time waits.
    periods: u32,
}

impl Overrun {
    /// Returns how long a due time waits for a node of this rate: up to a nanosecond more, because
    /// due times are rounded to that.
    pub(crate) fn patience(self, hz: Hz) -> Duration {
        let rounding = Duration::from_nanos(self.periods.min(1).into());
        hz.period().saturating_mul(self.periods) + rounding
    }
}

impl fmt::Display for Overrun {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.periods {
            0 => f.write_str(SKIP),
            u32::MAX => f.write_str(CATCH_UP),
            periods => write!(f, "{QUEUE}{periods}"),
        }
    }
}

impl FromStr for Overrun {
    type Err = SettingError;

    fn from_str(text: &str) -> Result<Self, SettingError> {
        let periods = match text.trim() {
            SKIP => Some(0),
            CATCH_UP => Some(u32::MAX),
            text => text
                .strip_prefix(QUEUE)
                .and_then(|count| count.parse().ok()),
        };
        periods
            .map(|periods| Self { periods })
            .ok_or_else(|| SettingError::Overrun(text.to_owned()))
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

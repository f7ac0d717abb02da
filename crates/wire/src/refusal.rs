//! Why a message from the wire is refused. It is counted then, and never obeyed.

use std::{
    fmt,
    sync::atomic::{AtomicU64, Ordering},
};

/// The reason to refuse a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// It does not begin as messages do.
    Format,
    /// It has another length than messages of its topic.
    Length,
    /// A number in it is infinite, not a number, or beyond single precision.
    NotFinite,
    /// Another process sends to this topic already.
    Sender,
    /// Its process sends it directly as well, and not by ROS alone.
    Twin,
    /// It was there already, or is older than one that was.
    Repeated,
    /// Its number is too far from the last one.
    Jump,
    /// The clock of its sender is not known yet.
    Clock,
    /// By the clocks it was published later than now.
    Future,
    /// It was published before the run began here.
    Early,
    /// Its numbers are no message of the topic.
    Content,
}

impl Refusal {
    /// All reasons.
    pub const ALL: [Self; 11] = [
        Self::Format,
        Self::Length,
        Self::NotFinite,
        Self::Sender,
        Self::Twin,
        Self::Repeated,
        Self::Jump,
        Self::Clock,
        Self::Future,
        Self::Early,
        Self::Content,
    ];

    /// Whether an honest sender causes it as well: at the start of a run, or by ROS beside
    /// ratelab's own way.
    pub fn is_harmless(self) -> bool {
        matches!(self, Self::Early | Self::Twin)
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Format => "unknown format",
            Self::Length => "wrong length",
            Self::NotFinite => "not finite",
            Self::Sender => "second sender",
            Self::Twin => "by ROS as well",
            Self::Repeated => "repeated",
            Self::Jump => "impossible number",
            Self::Clock => "unknown clock",
            Self::Future => "from the future",
            Self::Early => "from before the run",
            Self::Content => "invalid content",
        })
    }
}

/// The number of refused messages, by reason.
#[derive(Debug, Default)]
pub struct Refused([AtomicU64; Refusal::ALL.len()]);

impl Refused {
    /// Counts a refused message.
    pub fn count(&self, why: Refusal) {
        self.0[why as usize].fetch_add(1, Ordering::Relaxed);
    }

    /// The counts that are not zero, with their reasons.
    pub fn read(&self) -> Vec<(Refusal, u64)> {
        let counts = Refusal::ALL.iter().zip(&self.0);
        let counts = counts.map(|(why, count)| (*why, count.load(Ordering::Relaxed)));
        counts.filter(|(_, count)| *count > 0).collect()
    }

    /// The number of messages that no honest sender causes.
    pub fn hostile(&self) -> u64 {
        let counts = self.read().into_iter();
        counts
            .filter(|(why, _)| !why.is_harmless())
            .map(|(_, count)| count)
            .sum()
    }
}

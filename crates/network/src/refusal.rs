//! Why a message from the wire is refused. It is counted then, and never obeyed.

use std::{collections::BTreeMap, sync::Mutex};

use ratelab::sync::lock;
use thiserror::Error;

/// The reason to refuse a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Error)]
pub enum Refusal {
    /// It does not begin as messages do.
    #[error("unknown format")]
    Format,
    /// It has another length than messages of its topic.
    #[error("wrong length")]
    Length,
    /// A number in it is infinite, not a number, or beyond single precision.
    #[error("not finite")]
    NotFinite,
    /// Another process sends to this topic already.
    #[error("second sender")]
    Sender,
    /// Its process sends it directly as well, and not by ROS alone.
    #[error("by ROS as well")]
    Twin,
    /// It was there already, or is older than one that was.
    #[error("repeated")]
    Repeated,
    /// Its number is too far from the last one.
    #[error("impossible number")]
    Jump,
    /// The clock of its sender is not known yet.
    #[error("unknown clock")]
    Clock,
    /// By the clocks it was published later than now.
    #[error("from the future")]
    Future,
    /// It was published before the run began here.
    #[error("from before the run")]
    Early,
    /// Its numbers are no message of the topic.
    #[error("invalid content")]
    Content,
}

impl Refusal {
    /// Whether an honest sender causes it as well: at the start of a run, or by ROS beside
    /// ratelab's own way.
    pub fn is_harmless(self) -> bool {
        matches!(self, Self::Early | Self::Twin)
    }
}

/// The number of refused messages, by reason.
#[derive(Debug, Default)]
pub struct Refused(Mutex<BTreeMap<Refusal, u64>>);

impl Refused {
    /// Counts a refused message.
    pub fn count(&self, why: Refusal) {
        *lock(&self.0).entry(why).or_default() += 1;
    }

    /// The counts by reason.
    pub fn read(&self) -> BTreeMap<Refusal, u64> {
        lock(&self.0).clone()
    }

    /// The number of messages that no honest sender causes.
    pub fn hostile(&self) -> u64 {
        let counts = self.read().into_iter();
        let hostile = counts.filter(|(why, _)| !why.is_harmless());
        hostile.map(|(_, count)| count).sum()
    }
}

//! The metadata of a message.

use super::{tap::TapMessage, time::Time};

/// A message without its payload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Head {
    /// Run time at which it was published.
    pub at: Time,
    /// Run time of publication.
    pub stamp: Time,
    /// Position in the topic's history, counted from zero.
    pub seq: u64,
    /// Run time of the sensing that it was derived from, if known.
    pub origin: Option<Time>,
    /// Run time at which it is delivered; `None` if it is lost.
    pub arrives: Option<Time>,
    /// Messages of the topic lost unread so far, over all subscriptions.
    pub dropped: u64,
}

impl Head {
    /// The metadata of a message on a tap.
    pub fn of<T>(tapped: &TapMessage<T>) -> Self {
        let message = &tapped.message;
        Self {
            at: tapped.at,
            stamp: message.stamp,
            seq: message.seq,
            origin: message.origin,
            arrives: tapped.arrives,
            dropped: tapped.dropped,
        }
    }
}

//! What is known of a message without its payload.

use super::time::Time;

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

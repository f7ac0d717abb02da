//! Messages that were taken, and sets of them.

use crate::time::Time;

/// A message taken from a queue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TakenMessage {
    /// Its sequence number.
    pub seq: u64,
    /// Run time of the sensing behind it.
    pub sensed: Time,
    /// Run time of its delivery.
    pub arrived: Time,
}

/// The sequence numbers of a set, one for each input.
pub type Choice = Vec<u64>;

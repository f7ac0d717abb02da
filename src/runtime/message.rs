//! What travels on a topic.

use super::time::Time;

/// What a topic can carry: plain data that any thread may hold a copy of.
pub trait Payload: Clone + Send + 'static {}

impl<T: Clone + Send + 'static> Payload for T {}

/// One published value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Message<T> {
    /// The value.
    pub data: T,
    /// Run time at which it was published.
    pub stamp: Time,
    /// Position in the topic's history, counted from zero.
    pub seq: u64,
    /// Run time of the sensing that the value was derived from, where known:
    /// what lets the last node of a chain measure the delay of the whole.
    pub origin: Option<Time>,
}

impl<T> Message<T> {
    /// Run time of the sensing behind the value: where it is not derived from any,
    /// that of the message itself.
    pub fn sensed(&self) -> Time {
        self.origin.unwrap_or(self.stamp)
    }
}

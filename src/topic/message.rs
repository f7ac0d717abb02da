//! Messages on a topic.

use crate::{record::Head, time::Time};

/// A type that a topic can carry: plain data that can be copied to any thread.
pub trait Payload: Clone + Send + 'static {}

impl<T: Clone + Send + 'static> Payload for T {}

/// A published value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Message<T> {
    /// The value.
    pub data: T,
    /// Run time of publication, as the clock of its node shows it: that of the tick, or of its
    /// end if it takes run time.
    pub stamp: Time,
    /// Position in the topic's history, counted from zero.
    pub seq: u64,
    /// Run time of the sensing that the value was derived from, if known, as the clock of the node
    /// that sensed shows it: the header stamp of ROS. The last node of a chain uses it to measure
    /// the delay of the whole chain.
    pub origin: Option<Time>,
}

impl<T> Message<T> {
    /// The message with this `head`.
    pub fn of(head: &Head, data: T) -> Self {
        Self {
            data,
            stamp: head.stamp,
            seq: head.seq,
            origin: head.origin,
        }
    }

    /// Run time of the sensing behind the value; the message's own stamp if it has no
    /// origin.
    pub fn sensed(&self) -> Time {
        self.origin.unwrap_or(self.stamp)
    }
}

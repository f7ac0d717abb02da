//! What a scheduler takes from the topics that trigger a node.
//!
//! A message is taken when a scheduler calls the node, as a ROS subscription's callback takes it:
//! one message for each call, the oldest that its queue keeps. Once the messages taken make a
//! set, the node ticks, and its subscriptions read that set.

use crate::time::Time;

/// A topic that triggers a node, regardless of its payload.
pub trait Intake: Send {
    /// Run time of the delivery of the oldest message that was not yet taken.
    fn oldest(&self, now: Time) -> Option<Time>;

    /// Number of messages that wait at `now`.
    fn waiting(&self, now: Time) -> usize;

    /// Takes the oldest of them.
    fn take(&mut self, now: Time) -> Option<TakenMessage>;

    /// Lets the subscription read the message taken as number `seq`.
    fn choose(&mut self, seq: u64);

    /// Forgets the messages taken before number `seq`; all of them without a `seq`.
    fn forget_before(&mut self, seq: Option<u64>);
}

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

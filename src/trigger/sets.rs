//! Messages that were taken, and sets of them.

use std::{collections::VecDeque, fmt};

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

/// How the messages of the topics that trigger a node become the inputs of its ticks; as text its
/// name in a [`NodeTopology`](crate::NodeTopology).
pub trait Matching: fmt::Debug + fmt::Display + Send + Sync {
    /// Finds the sets among messages of so many `inputs`, none of which has come.
    fn sets(&self, inputs: usize) -> Box<dyn Sets>;
}

/// Finds the sets among messages that are taken one by one.
pub trait Sets: Send {
    /// Adds a message; returns the set that it completes, and puts any others into `more`.
    fn add(
        &mut self,
        input: usize,
        taken: TakenMessage,
        more: &mut VecDeque<Choice>,
    ) -> Option<Choice>;

    /// The first message of an input that may still be needed.
    fn needs_from(&self, input: usize) -> Option<u64>;
}

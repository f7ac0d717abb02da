//! What a queue keeps for its readers.

use std::collections::VecDeque;

use super::message::Message;
use crate::{
    arrival::{Arrival, Arrivals},
    sync::Arc,
    time::Time,
};

/// Read position and losses of a subscription.
pub(super) struct TopicReader<T> {
    /// Sequence number of the oldest unseen message.
    pub(super) next_unread: u64,
    /// Messages evicted before it saw them.
    pub(super) dropped: u64,
    /// Its place among the readers of the topic in a graph; `None` outside.
    pub(super) place: Option<usize>,
    /// Whether its subscription is there. A node that is built once more finds its reader again.
    pub(super) is_open: bool,
    /// Set if its messages trigger its node.
    pub(super) trigger: Option<Box<TriggerEnd<T>>>,
}

impl<T> TopicReader<T> {
    /// Creates one that has seen all messages before number `next`.
    pub(super) fn new(next: u64, place: Option<usize>) -> Self {
        Self {
            next_unread: next,
            dropped: 0,
            place,
            is_open: true,
            trigger: None,
        }
    }
}

/// A reader that triggers its node.
pub(super) struct TriggerEnd<T> {
    /// Index of the node, and number of the topic in the list of topics that trigger it.
    pub(super) node: usize,
    pub(super) input: usize,
    pub(super) arrivals: Arc<Arrivals>,
    /// The messages that it has taken and that may still be read.
    pub(super) taken: VecDeque<Message<T>>,
    /// The message that it reads.
    pub(super) chosen: Option<Message<T>>,
    /// Whether the node has yet to read it, for a node that takes each message once.
    pub(super) is_new: bool,
}

impl<T> TriggerEnd<T> {
    /// Returns the arrival of a message at run time `at`.
    pub(super) fn arrival(&self, at: Time) -> Arrival {
        let (node, input) = (self.node, self.input);
        Arrival { at, node, input }
    }
}

//! What a queue keeps for its readers.

use std::collections::VecDeque;

use super::message::Message;
use crate::{
    arrival::{Arrival, Arrivals},
    sync::{Arc, atomic::AtomicU64},
    time::Time,
};

/// Read position and losses of one subscription, written under the lock of the queue only.
#[derive(Debug, Default)]
pub(crate) struct ReadMark {
    /// Sequence number of the oldest unseen message.
    pub(super) next_unread: AtomicU64,
    pub(super) dropped: AtomicU64,
    /// Its place among the readers of the topic in a graph; `None` outside.
    pub(super) reader: Option<usize>,
}

impl ReadMark {
    /// A reader that has seen all messages before number `next`.
    pub(super) fn new(next: u64, reader: Option<usize>) -> Self {
        Self {
            next_unread: AtomicU64::new(next),
            dropped: AtomicU64::new(0),
            reader,
        }
    }
}

/// What a queue keeps for the nodes that its messages trigger.
#[derive(Debug)]
pub(super) struct Triggers<T> {
    /// Run times of the deliveries of the messages in the queue.
    pub(super) delivered: VecDeque<Time>,
    pub(super) readers: Vec<TriggerReader<T>>,
}

/// A subscription that triggers its node.
#[derive(Debug)]
pub(super) struct TriggerReader<T> {
    pub(super) mark: Arc<ReadMark>,
    /// Index of the node, and number of the topic among those that trigger it.
    pub(super) node: usize,
    pub(super) input: usize,
    pub(super) arrivals: Arc<Arrivals>,
    /// The messages that it has taken and that may still be read.
    pub(super) taken: VecDeque<Message<T>>,
    /// The message that it reads.
    pub(super) chosen: Option<Message<T>>,
}

impl<T> Triggers<T> {
    /// Announces a message that will arrive at run time `at`.
    pub(super) fn announce(&self, at: Time) {
        for (reader, arrival) in self.readers.iter().zip(self.arrivals(at)) {
            reader.arrivals.add(arrival);
        }
    }

    /// The arrivals of a message at run time `at`.
    pub(super) fn arrivals(&self, at: Time) -> impl Iterator<Item = Arrival> {
        let readers = self.readers.iter();
        readers.map(move |reader| Arrival {
            at,
            node: reader.node,
            input: reader.input,
        })
    }

    /// The subscription with this read position, if it triggers its node.
    pub(super) fn reader(&self, mark: &Arc<ReadMark>) -> Option<&TriggerReader<T>> {
        self.readers
            .iter()
            .find(|reader| Arc::ptr_eq(&reader.mark, mark))
    }
}

//! What a queue keeps for the nodes that its messages trigger.

use std::collections::VecDeque;

use super::{mark::ReadMark, message::Message};
use crate::{
    sync::Arc,
    time::Time,
    trigger::{Arrival, Arrivals},
};

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
    /// Adds the delivery of the newest message.
    pub(super) fn push(&mut self, at: Time) {
        self.delivered.push_back(at);
    }

    /// Removes the delivery of the oldest message.
    pub(super) fn evict(&mut self) {
        self.delivered.pop_front();
    }

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

    /// The message that the subscription with this read position reads.
    pub(super) fn chosen(&self, mark: &Arc<ReadMark>) -> Option<&Message<T>> {
        self.reader(mark)?.chosen.as_ref()
    }

    /// Whether the subscription with this read position triggers its node.
    pub(super) fn knows(&self, mark: &Arc<ReadMark>) -> bool {
        self.reader(mark).is_some()
    }

    fn reader(&self, mark: &Arc<ReadMark>) -> Option<&TriggerReader<T>> {
        self.readers
            .iter()
            .find(|reader| Arc::ptr_eq(&reader.mark, mark))
    }
}

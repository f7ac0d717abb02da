//! Taps on a graph that runs.

use super::{
    message::Payload,
    sync::Arc,
    tap::{Backpressure, Tap, TapMessage, TickRecord, TickTaps, tap},
    topic::Topic,
};

/// Taps a graph, before it runs and while it does, from any thread. Knows the
/// nodes that the graph had when it was asked for.
///
/// The clock decides whether a full tap waits: in virtual time it does, because
/// waiting costs none; in real time it loses and counts.
#[derive(Clone, Debug)]
pub struct TapHandle {
    pub(crate) backpressure: Backpressure,
    pub(crate) nodes: Vec<Arc<TickTaps>>,
}

impl TapHandle {
    /// Copies every message of `topic` from now on, in a queue of `capacity`.
    pub fn topic<T: Payload>(&self, topic: &Topic<T>, capacity: usize) -> Tap<TapMessage<T>> {
        topic.tap(capacity, self.backpressure.clone())
    }

    /// Copies every tick from now on, for each node in the order in which they
    /// were added, in queues of `capacity`. They end with the graph.
    pub fn ticks(&self, capacity: usize) -> Vec<Tap<TickRecord>> {
        let nodes = self.nodes.iter();
        nodes
            .map(|node| {
                let (end, tap) = tap(capacity, self.backpressure.clone());
                node.add(end);
                tap
            })
            .collect()
    }
}

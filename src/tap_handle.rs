//! Taps on a running graph.

use super::{
    message::Payload,
    sync::Arc,
    tap::{Backpressure, Copies, Tap, TapMessage, TickRecord, tap},
    topic::Topic,
};

/// Taps a graph from any thread, before and during its run. Covers the nodes that the
/// graph had when the handle was created.
///
/// The clock decides whether a full tap blocks: in virtual time it does, because waiting
/// costs no run time; in real time it loses messages and counts them.
#[derive(Clone, Debug)]
pub struct TapHandle {
    pub(crate) backpressure: Backpressure,
    pub(crate) nodes: Vec<Arc<Copies<TickRecord>>>,
}

impl TapHandle {
    /// Copies every message of `topic` from now on, in a queue of `capacity` messages.
    pub fn topic<T: Payload>(&self, topic: &Topic<T>, capacity: usize) -> Tap<TapMessage<T>> {
        topic.tap(capacity, self.backpressure.clone())
    }

    /// Copies every tick from now on, with one queue of `capacity` ticks per node, in the
    /// order of addition. The taps end with the graph.
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

//! Taps on a running graph.

use std::{any::Any, fmt};

use ratelab::{Graph, Head, Message, Payload, Sink, Topic, sync::Arc};

use crate::{
    node::TickRecord,
    sink::AccountSink,
    tap::{Tap, TapMessage, TapSender, tap},
};

/// Taps a graph from any thread, before and during its run. Covers the nodes and topics that the
/// graph had when it was first tapped or observed.
///
/// The clock decides whether a full tap blocks: in virtual time it does, because waiting
/// costs no run time; in real time it loses messages and counts them.
#[derive(Clone)]
pub struct TapHandle(pub(crate) Arc<AccountSink>);

impl TapHandle {
    /// Taps on `graph`.
    pub fn new(graph: &Graph) -> Self {
        Self(AccountSink::from_graph(graph))
    }

    /// Sends every record to one other `sink` from now on, before it is counted here; returns
    /// `false` if there is another sink already.
    pub fn forward_records_to(&self, sink: Arc<dyn Sink>) -> bool {
        self.0.first.set(sink).is_ok()
    }

    /// Copies every message of `topic` from now on, in a queue of `capacity` messages.
    pub fn topic<T: Payload>(&self, topic: &Topic<T>, capacity: usize) -> Tap<TapMessage<T>> {
        let (end, tap) = self.tap(capacity);
        self.listen(topic, move |head, data: &T| {
            let (message, head) = (Message::from_head(head, data.clone()), *head);
            end.offer(TapMessage { message, head })
        });
        tap
    }

    /// Copies every tick from now on, with one queue of `capacity` ticks per node, in the
    /// order of addition. The taps end with the graph.
    pub fn ticks(&self, capacity: usize) -> Vec<Tap<TickRecord>> {
        let taps = self.0.ticks.iter().map(|node| {
            let (end, tap) = self.tap(capacity);
            node.add(Box::new(move |tick: &TickRecord| end.offer(tick.clone())));
            tap
        });
        taps.collect()
    }

    /// Returns a tap for `capacity` items, with the end to be filled by a listener.
    pub(crate) fn tap<I>(&self, capacity: usize) -> (TapSender<I>, Tap<I>) {
        tap(capacity, Some(self.0.run.clone()))
    }

    /// Calls `hear` with every message of `topic` from now on, when it is published, until that
    /// returns `false`. It is called by the publisher, so it has to be quick.
    pub(crate) fn listen<T: Payload>(
        &self,
        topic: &Topic<T>,
        mut hear: impl FnMut(&Head, &T) -> bool + Send + 'static,
    ) {
        let index = topic.index();
        if let Some(listeners) = index.and_then(|index| self.0.topics.get(index)) {
            listeners.add(Box::new(move |head: &Head, payload: &dyn Any| {
                payload.downcast_ref().is_some_and(|data| hear(head, data))
            }));
        }
    }
}

impl fmt::Debug for TapHandle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("TapHandle").finish_non_exhaustive()
    }
}

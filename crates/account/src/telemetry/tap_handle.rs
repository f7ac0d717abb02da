//! Taps on a running graph.

use std::{any::Any, fmt};

use ratelab::{Graph, Payload, Time, Topic, sync::Arc};

use super::{
    listeners::PayloadWatcher,
    tap::{Tap, TapMessage, TickRecord, tap},
    telemetry_sink::TelemetrySink,
};

/// Taps a graph from any thread, before and during its run. Covers the nodes and topics that the
/// graph had when it was first tapped or observed.
///
/// The clock decides whether a full tap blocks: in virtual time it does, because waiting
/// costs no run time; in real time it loses messages and counts them.
#[derive(Clone)]
pub struct TapHandle(Arc<TelemetrySink>);

impl TapHandle {
    /// Taps on `graph`.
    pub fn of(graph: &Graph) -> Self {
        Self(TelemetrySink::of(graph))
    }

    /// Copies every message of `topic` from now on, in a queue of `capacity` messages.
    pub fn topic<T: Payload>(&self, topic: &Topic<T>, capacity: usize) -> Tap<TapMessage<T>> {
        let (end, tap) = tap(capacity, Some(self.0.run.clone()));
        let index = topic.index();
        if let Some(listeners) = index.and_then(|index| self.0.topics.get(index)) {
            listeners.add(end);
        }
        tap
    }

    /// Copies every tick from now on, with one queue of `capacity` ticks per node, in the
    /// order of addition. The taps end with the graph.
    pub fn ticks(&self, capacity: usize) -> Vec<Tap<TickRecord>> {
        let nodes = self.0.ticks.iter();
        nodes
            .map(|node| {
                let (end, tap) = tap(capacity, Some(self.0.run.clone()));
                node.add(end);
                tap
            })
            .collect()
    }

    /// Calls `watch` with the run time and the payload of every message of `topic` from now on,
    /// when it is published. It is called by the publisher, so it has to be quick.
    pub(crate) fn watch<T: Payload>(
        &self,
        topic: &Topic<T>,
        mut watch: impl FnMut(Time, &T) + Send + 'static,
    ) {
        let hear = move |now, payload: &dyn Any| {
            if let Some(data) = payload.downcast_ref() {
                watch(now, data);
            }
        };
        let index = topic.index();
        if let Some(listeners) = index.and_then(|index| self.0.topics.get(index)) {
            listeners.add(PayloadWatcher(hear));
        }
    }
}

impl fmt::Debug for TapHandle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("TapHandle").finish_non_exhaustive()
    }
}

//! The sink of a graph that is looked at: figures, and copies for taps.

use std::any::Any;

use ratelab::{
    Graph, NodeRecord, RunState, Sink, TickTimes, TopicRecord,
    sync::{Arc, atomic::Ordering},
};

use super::{
    listeners::Listeners,
    run_counters::RunCounters,
    tap::{Copies, TickRecord},
};

/// Figures, and copies for taps.
pub(super) struct TelemetrySink {
    pub(super) run: Arc<RunState>,
    pub(super) figures: RunCounters,
    /// The ticks of each node.
    pub(super) ticks: Vec<Copies<TickRecord>>,
    /// Those who listen to each topic.
    pub(super) topics: Vec<Listeners>,
}

impl TelemetrySink {
    /// The sink of `graph`, from now on if it had none. Covers the nodes and topics that the
    /// graph has at this moment. Beside a sink of another kind it gets nothing.
    pub(super) fn of(graph: &Graph) -> Arc<Self> {
        let sink: Arc<dyn Any + Send + Sync> = graph.sink_or(|| Arc::new(Self::new(graph)));
        let known = sink.downcast::<Self>();
        known.unwrap_or_else(|_| Arc::new(Self::new(graph)))
    }

    fn new(graph: &Graph) -> Self {
        let figures = RunCounters::of(graph);
        let (nodes, topics) = (figures.nodes.iter(), figures.topics.iter());
        Self {
            run: graph.state(),
            ticks: nodes.map(|_| Copies::default()).collect(),
            topics: topics.map(|_| Listeners::default()).collect(),
            figures,
        }
    }

    /// Copies a tick for the taps of its node.
    fn copy(&self, node: usize, times: &TickTimes) {
        let Some((copies, figures)) = self.ticks.get(node).zip(self.figures.nodes.get(node)) else {
            return;
        };
        copies.offer(|| TickRecord {
            number: figures.ticks.load(Ordering::Relaxed).saturating_sub(1),
            at: times.at,
            ends: times.ends,
            lateness: times.lateness,
            took: times.took,
            overruns: figures.overruns.load(Ordering::Relaxed),
            push: {
                let newest = figures.push_age.in_force();
                newest.filter(|push| Some(push.at) == times.ends)
            },
        });
    }
}

impl Sink for TelemetrySink {
    fn node(&self, node: usize, record: &NodeRecord) {
        self.figures.node(node, record);
        if let NodeRecord::Ticked(times) = record {
            self.copy(node, times);
        }
    }

    fn topic(&self, topic: usize, record: &TopicRecord<'_>) {
        self.figures.topic(topic, record);
        if let TopicRecord::Sent { head, payload, .. } = record
            && let Some(listeners) = self.topics.get(topic)
        {
            listeners.hear(head, *payload);
        }
    }
}

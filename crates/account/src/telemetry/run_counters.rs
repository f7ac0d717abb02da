//! The figures of a run: a fold over its records.

use ratelab::{
    Graph, NodeRecord, TopicRecord, Topology,
    sync::{Arc, atomic::Ordering, bump},
};

use super::counters::{NodeCounters, TopicCounters};

/// The figures of the nodes and topics of a graph, by their indices. Each has one writer at a
/// time: those of a topic under its lock, those of a node on its thread.
/// Clones are handles to the same figures.
#[derive(Clone, Debug)]
pub(super) struct RunCounters {
    /// The graph when the figures were zero.
    topology: Arc<Topology>,
    pub(super) nodes: Arc<[NodeCounters]>,
    pub(super) topics: Arc<[TopicCounters]>,
}

impl RunCounters {
    /// Figures at zero for a graph with this `topology`, all of whose nodes run here.
    pub(super) fn new(topology: Topology) -> Self {
        Self {
            nodes: topology.nodes.iter().map(NodeCounters::new).collect(),
            topics: topology.topics.iter().map(TopicCounters::new).collect(),
            topology: topology.into(),
        }
    }

    /// Figures at zero for a graph as it is.
    pub(super) fn of(graph: &Graph) -> Self {
        let figures = Self::new(graph.topology());
        for (index, node) in figures.nodes.iter().enumerate() {
            node.set_crashed(graph.is_crashed(index));
            node.remote.store(!graph.is_here(index), Ordering::Relaxed);
        }
        figures
    }

    /// The graph when the figures were zero.
    pub(super) fn topology_before(&self) -> &Topology {
        &self.topology
    }

    /// The graph with the rates and depths in force.
    pub(super) fn topology(&self) -> Topology {
        let mut topology = (*self.topology).clone();
        let rates = topology.rates(|node| self.nodes[node].hz());
        let nodes = topology.nodes.iter_mut().zip(rates);
        nodes.for_each(|(node, hz)| node.hz = hz);
        for (topic, figures) in topology.topics.iter_mut().zip(&*self.topics) {
            topic.depth = figures.depth();
        }
        topology
    }

    /// Adds a record of a node. Nodes that were added to the graph later have no figures.
    #[inline]
    pub(super) fn node(&self, node: usize, record: &NodeRecord) {
        let Some(node) = self.nodes.get(node) else {
            return;
        };
        match record {
            NodeRecord::Began { lasting, .. } => {
                bump(&node.ticks);
                if *lasting {
                    node.busy.store(true, Ordering::Relaxed);
                }
            }
            NodeRecord::Ended => node.busy.store(false, Ordering::Relaxed),
            NodeRecord::Ticked(times) => node.tick(times),
            NodeRecord::Skipped(ticks) => {
                node.overruns.fetch_add(*ticks, Ordering::Relaxed);
            }
            NodeRecord::Rate(hz) => node.set_hz(*hz),
            NodeRecord::Crashed => node.set_crashed(true),
            NodeRecord::Restarted => node.set_crashed(false),
            NodeRecord::Measured { meter, sample } => {
                if let Some(meter) = node.meters.get(*meter) {
                    meter.record(*sample);
                }
            }
            NodeRecord::Pushed(push) => node.push_age.push(push.at, push.sensed),
        }
    }

    /// Adds a record of a topic. Topics that were added to the graph later have no figures.
    #[inline]
    pub(super) fn topic(&self, topic: usize, record: &TopicRecord<'_>) {
        let Some(topic) = self.topics.get(topic) else {
            return;
        };
        let reader = |reader: usize| topic.readers.get(reader);
        match record {
            TopicRecord::Sent { head, link, .. } => topic.sent(head, *link),
            TopicRecord::Delivered { overtaken } => topic.delivered(*overtaken),
            TopicRecord::Dropped { reader: of, at } => {
                if let Some(reader) = of.and_then(reader) {
                    bump(&reader.dropped);
                    reader.drops.count(*at);
                }
            }
            TopicRecord::Read { reader: of, age } => {
                if let Some(reader) = reader(*of) {
                    reader.ages.record(*age);
                }
            }
            TopicRecord::Depth(depth) => {
                topic.set_depth(*depth);
            }
        }
    }
}

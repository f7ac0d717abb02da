//! The nodes of a graph file, wired to their topics.

use std::sync::Arc;

use ratelab::{Shared, Time, Topic, Wiring};

use super::{
    GraphSystem, NodeSpec,
    error::Placed,
    graph_node::{ChainEnd, ChainEnds, GraphNode, NodeInput},
};
use crate::{
    BuildError, Builder, CHAINS, ChainAges, ChainTracker, DataChain, ForwardingNode, Numbers,
    RecordedTopics, chain_fields,
};

/// Name of the number in the messages of a graph file: the header stamp.
const STAMPED: &str = "origin (ns)";

/// What the nodes share: their topics, and the ages of the chains.
#[derive(Clone)]
struct GraphWires {
    topics: Vec<Topic<f64>>,
    tracker: Arc<ChainTracker>,
    ages: Arc<Shared<ChainAges>>,
    chains: Topic<Numbers>,
}

impl GraphWires {
    fn new(system: &GraphSystem, builder: &mut Builder<'_>) -> Self {
        let mut topics: Vec<Topic<f64>> = Vec::new();
        for name in system.file.published().filter(|name| system.is_own(name)) {
            if topics.iter().all(|known| known.name() != name) {
                let topic = builder.internal_topic(name);
                builder.record_as(topic.clone(), [STAMPED]);
                topics.push(topic);
            }
        }
        let chains = builder.internal_topic(CHAINS);
        if !system.chains.is_empty() {
            let names = system.chains.iter().map(DataChain::name);
            builder.record_as(chains.clone(), chain_fields(names));
        }
        let limits = system
            .chains
            .iter()
            .map(|chain| chain.limit.map(|limit| limit.age));
        let ages = Arc::new(Shared::new("data ages of chains", ChainAges::new(limits)));
        Self {
            topics,
            tracker: Arc::default(),
            ages,
            chains,
        }
    }
}

impl GraphSystem {
    /// Returns the nodes of the file between a topic of the system and its reader.
    pub(super) fn relays(&self) -> &[ForwardingNode] {
        self.middle.as_ref().map_or(&[], |middle| &middle.relays)
    }

    /// Returns whether `topic` is one that the nodes of the file publish, and none behind a topic
    /// of the system.
    fn is_own(&self, topic: &str) -> bool {
        let published = self.file.published().any(|known| known == topic);
        published && self.relays().iter().all(|relay| relay.to != topic)
    }

    /// Adds the nodes of the file, except nodes before a reader of the system.
    pub(super) fn add_nodes(&self, builder: &mut Builder<'_>) -> Result<(), BuildError> {
        let wires = GraphWires::new(self, builder);
        for (index, node) in self.file.nodes.iter().enumerate() {
            if self.relays().iter().all(|relay| relay.node != node.name) {
                self.add_node(builder, index, node, &wires)?;
            }
        }
        if !self.chains.is_empty() {
            wires
                .tracker
                .follow(&self.chains, &builder.graph.topology());
            builder.tracker = Some(wires.tracker);
        }
        Ok(())
    }

    /// Adds node number `index` of the file.
    fn add_node(
        &self,
        builder: &mut Builder<'_>,
        index: usize,
        node: &NodeSpec,
        wires: &GraphWires,
    ) -> Result<(), BuildError> {
        let inputs = |topics: &[Placed]| -> RecordedTopics {
            topics
                .iter()
                .filter_map(|topic| builder.recorded(&topic.text))
                .collect()
        };
        let (triggers, reads) = (inputs(&node.triggers), inputs(&node.reads));
        let (outputs, ends) = (self.outputs(node, wires), self.ends(node));
        let (alone, wires) = (self.middle.is_none(), wires.clone());
        // After the nodes of a system that are due at the same time.
        let before = if alone { 0 } else { 100 };
        let priority = before + node.priority.unwrap_or(index as u32);
        let (release, stamp, only_new) = (node.release, node.stamp, node.only_new);
        builder.released_node(&node.name, release, priority, move |wiring| {
            let mut inputs: Vec<_> = triggers
                .iter()
                .map(|topic| topic.trigger(wiring))
                .map(NodeInput::new)
                .collect();
            let reads = reads.iter().map(|topic| topic.reader(wiring));
            inputs.extend(reads.map(NodeInput::new));
            let outputs = outputs.iter().map(|topic| wiring.publisher(topic));
            GraphNode {
                inputs,
                outputs: outputs.collect(),
                stamp,
                only_new,
                published: false,
                row: Vec::new(),
                ends: (!ends.is_empty()).then(|| wires.ends(wiring, &ends, alone)),
            }
        })
    }

    /// Returns the topics that `node` publishes.
    fn outputs(&self, node: &NodeSpec, wires: &GraphWires) -> Vec<Topic<f64>> {
        let outputs = node.publishes.iter().filter_map(|Placed { text, .. }| {
            wires
                .topics
                .iter()
                .find(|topic| topic.name() == text)
                .cloned()
        });
        outputs.collect()
    }

    /// Returns the numbers and the names of the chains that end at `node`.
    fn ends(&self, node: &NodeSpec) -> Vec<(usize, String)> {
        self.chains
            .iter()
            .enumerate()
            .filter(|(_, chain)| chain.last() == node.name)
            .map(|(number, chain)| (number, chain.name.clone()))
            .collect()
    }
}

impl GraphWires {
    /// Returns what the chains with these ends take. A system in the middle measures itself what it
    /// does: the nodes are `alone` without one.
    fn ends(&self, wiring: &mut Wiring<'_>, ends: &[(usize, String)], alone: bool) -> ChainEnds {
        let chains = ends.iter().map(|(number, name)| ChainEnd {
            number: *number,
            meter: wiring.meter(name),
        });
        let chains: Vec<_> = chains.collect();
        ChainEnds {
            acts: alone && chains.iter().any(|chain| chain.number == 0),
            chains,
            tracker: self.tracker.clone(),
            ages: self.ages.clone(),
            publisher: wiring.publisher(&self.chains),
            began: Time::ZERO,
        }
    }
}

//! The nodes of a graph file, wired to their topics.

use std::sync::Arc;

use ratelab::{Shared, Topic};
use ratelab_account::RecordedTopic;

use super::{
    GraphSystem, NodeSpec,
    graph_node::{Beginning, ChainEnd, ChainEnds, GraphNode, NodeInput, Output},
    place::Placed,
};
use crate::system::{BuildError, Builder, CHAINS, ChainAges, Numbers, chain_fields, kept_list};

/// What the nodes share: their topics, and the ages of the chains.
struct GraphWires {
    topics: Vec<Topic<Numbers>>,
    ages: Arc<Shared<ChainAges>>,
    chains: Topic<Numbers>,
}

impl GraphWires {
    fn of(system: &GraphSystem, builder: &mut Builder<'_>) -> Self {
        let topics = system.topics.iter();
        let topics = topics.map(|topic| builder.named_topic(&topic.name, topic.fields));
        let topics = topics.collect();
        let names = system.chains.iter().map(|chain| chain.name);
        let limits = system.chains.iter();
        let limits = limits.map(|chain| chain.limit.map(|limit| limit.age));
        Self {
            topics,
            ages: Arc::new(Shared::new("data ages of chains", ChainAges::new(limits))),
            chains: match system.chains.is_empty() {
                true => builder.internal_topic(CHAINS),
                false => builder.named_topic(CHAINS, kept_list(chain_fields(names))),
            },
        }
    }
}

impl GraphSystem {
    /// Adds the nodes of the file, but for those before a reader of the system.
    pub(super) fn add_nodes(&self, builder: &mut Builder<'_>) -> Result<(), BuildError> {
        let wires = GraphWires::of(self, builder);
        let nodes = self.file.nodes.iter().enumerate();
        for (index, node) in nodes.filter(|(_, node)| !self.is_relay(&node.name)) {
            self.add_node(builder, index, node, &wires)?;
        }
        Ok(())
    }

    /// Whether a node of the file is between a topic of the system and its reader.
    fn is_relay(&self, node: &str) -> bool {
        let mut relays = self.middle.iter().flat_map(|middle| &middle.relays);
        relays.any(|relay| relay.node == node)
    }

    /// Adds node number `index` of the file.
    fn add_node(
        &self,
        builder: &mut Builder<'_>,
        index: usize,
        node: &NodeSpec,
        wires: &GraphWires,
    ) -> Result<(), BuildError> {
        let inputs = |topics: &[Placed]| {
            let topics = topics.iter();
            let topics = topics.filter_map(|topic| builder.recorded(&topic.text));
            topics.collect::<Vec<Arc<dyn RecordedTopic>>>()
        };
        let (triggers, reads) = (inputs(&node.triggers), inputs(&node.reads));
        let outputs = self.outputs(node, wires);
        let ends = self.chains.iter().enumerate();
        let ends = ends.filter(|(_, chain)| chain.last() == node.name);
        let ends = ends.map(|(at, chain)| (at, chain.name, self.beginning(node, at, None)));
        let ends: Vec<_> = ends.collect();
        let acts = self.middle.is_none() && ends.iter().any(|(chain, ..)| *chain == 0);
        let (ages, chains) = (wires.ages.clone(), wires.chains.clone());
        // After the nodes of a system that are due at the same time.
        let before = if self.middle.is_some() { 100 } else { 0 };
        let priority = before + node.priority.unwrap_or(index as u32);
        builder.released_node(&node.name, node.release.clone(), priority, move |wiring| {
            let mut inputs = Vec::new();
            for topic in &triggers {
                inputs.push(NodeInput::new(topic.trigger(wiring)));
            }
            for topic in &reads {
                inputs.push(NodeInput::new(topic.reader(wiring)));
            }
            let mut published = Vec::new();
            for (topic, chains) in &outputs {
                let (publisher, chains) = (wiring.publisher(topic), chains.clone());
                published.push(Output { publisher, chains });
            }
            let measured = ends.iter().map(|(number, name, beginning)| ChainEnd {
                number: *number,
                beginning: *beginning,
                meter: wiring.meter(name),
                begun: None,
            });
            let measured: Vec<_> = measured.collect();
            GraphNode {
                inputs,
                outputs: published,
                ends: (!measured.is_empty()).then(|| ChainEnds {
                    chains: measured,
                    ages: ages.clone(),
                    publisher: wiring.publisher(&chains),
                    push_age: acts.then(|| wiring.push_age()),
                }),
            }
        })
    }

    /// The topics that `node` publishes, each with the beginnings of the chains through it.
    fn outputs(
        &self,
        node: &NodeSpec,
        wires: &GraphWires,
    ) -> Vec<(Topic<Numbers>, Vec<Beginning>)> {
        let outputs = node.publishes.iter().filter_map(|topic| {
            let mut own = self.topics.iter().zip(&wires.topics);
            let (own, wire) = own.find(|(own, _)| own.name == topic.text)?;
            let chains = own.chains.iter();
            let chains = chains.map(|chain| self.beginning(node, *chain, Some(&topic.text)));
            Some((wire.clone(), chains.collect()))
        });
        outputs.collect()
    }

    /// Where `node` takes the beginning of chain number `chain` from, for its output to
    /// `next`, or at the end of the chain.
    fn beginning(&self, node: &NodeSpec, chain: usize, next: Option<&str>) -> Beginning {
        let spec = &self.file.chains[chain];
        let Some(place) = spec.place(&node.name) else {
            return Beginning::Elsewhere;
        };
        if next.is_some_and(|next| spec.place(next) != Some(place + 1)) {
            return Beginning::Elsewhere;
        }
        let Some(before) = place.checked_sub(1) else {
            return Beginning::Tick;
        };
        let before = &spec.path[before].text;
        let mut reads = node.inputs();
        let Some(input) = reads.position(|topic| topic.text == *before) else {
            return Beginning::Elsewhere;
        };
        let own = self.topics.iter().find(|topic| topic.name == *before);
        let place = own.and_then(|own| own.chains.iter().position(|known| *known == chain));
        place.map_or(Beginning::Sensing { input }, |place| Beginning::Number {
            input,
            place,
        })
    }
}

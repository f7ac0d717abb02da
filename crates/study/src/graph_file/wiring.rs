//! The nodes of a graph file, wired to their topics.

use std::sync::Arc;

use ratelab::{Shared, Topic, Wiring};

use super::{
    GraphFile, GraphSystem, NodeSpec,
    error::Placed,
    graph_node::{Beginning, ChainEnd, ChainEnds, GraphNode, NodeInput, Output},
};
use crate::system::{
    BuildError, Builder, CHAINS, ChainAges, ForwardingNode, Numbers, RecordedTopics, chain_fields,
    kept_list,
};

/// What the nodes share: their topics, and the ages of the chains.
#[derive(Clone)]
struct GraphWires {
    topics: Vec<Topic<Numbers>>,
    ages: Arc<Shared<ChainAges>>,
    chains: Topic<Numbers>,
}

impl GraphWires {
    fn of(system: &GraphSystem, builder: &mut Builder<'_>) -> Self {
        let mut topics: Vec<Topic<Numbers>> = Vec::new();
        for name in system.file.published().filter(|name| system.is_own(name)) {
            if topics.iter().all(|known| known.name() != name) {
                let topic = builder.internal_topic(name);
                builder.record_as(topic.clone(), system.file.fields(name));
                topics.push(topic);
            }
        }
        let chains = builder.internal_topic(CHAINS);
        if !system.chains.is_empty() {
            let names = system.chains.iter().map(|chain| chain.name);
            builder.record_as(chains.clone(), kept_list(chain_fields(names)));
        }
        let limits = system.chains.iter();
        let limits = limits.map(|chain| chain.limit.map(|limit| limit.age));
        let ages = Arc::new(Shared::new("data ages of chains", ChainAges::new(limits)));
        Self {
            topics,
            ages,
            chains,
        }
    }
}

impl GraphFile {
    /// The numbers of the chains through `topic`.
    fn through(&self, topic: &str) -> impl Iterator<Item = usize> {
        let chains = self.chains.iter().enumerate();
        chains.filter_map(move |(number, chain)| chain.place(topic).map(|_| number))
    }

    /// Names of the numbers in the messages of `topic`.
    fn fields(&self, topic: &str) -> &'static [&'static str] {
        let through = self.through(topic).map(|number| &self.chains[number]);
        let names = through.map(|spec| format!("{} origin (ns)", spec.chain.name));
        match kept_list(names) {
            [] => &["origin (ns)"],
            names => names,
        }
    }
}

impl GraphSystem {
    /// The nodes of the file between a topic of the system and its reader.
    pub(super) fn relays(&self) -> &[ForwardingNode] {
        self.middle.as_ref().map_or(&[], |middle| &middle.relays)
    }

    /// Whether `topic` is one that the nodes of the file publish, and none behind a topic of the
    /// system.
    fn is_own(&self, topic: &str) -> bool {
        let published = self.file.published().any(|known| known == topic);
        published && self.relays().iter().all(|relay| relay.to != topic)
    }

    /// Adds the nodes of the file, but for those before a reader of the system.
    pub(super) fn add_nodes(&self, builder: &mut Builder<'_>) -> Result<(), BuildError> {
        let wires = GraphWires::of(self, builder);
        for (index, node) in self.file.nodes.iter().enumerate() {
            if self.relays().iter().all(|relay| relay.node != node.name) {
                self.add_node(builder, index, node, &wires)?;
            }
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
            let topics = topics.iter();
            let topics = topics.filter_map(|topic| builder.recorded(&topic.text));
            topics.collect()
        };
        let (triggers, reads) = (inputs(&node.triggers), inputs(&node.reads));
        let (outputs, ends) = (self.outputs(node, wires), self.ends(node));
        let (alone, wires) = (self.middle.is_none(), wires.clone());
        // After the nodes of a system that are due at the same time.
        let before = if alone { 0 } else { 100 };
        let priority = before + node.priority.unwrap_or(index as u32);
        let (release, stamp) = (node.release, node.stamp);
        builder.released_node(&node.name, release, priority, move |wiring| {
            let triggers = triggers.iter().map(|topic| topic.trigger(wiring));
            let mut inputs: Vec<_> = triggers.map(NodeInput::new).collect();
            let reads = reads.iter().map(|topic| topic.reader(wiring));
            inputs.extend(reads.map(NodeInput::new));
            let outputs = outputs.iter().map(|(topic, chains)| Output {
                publisher: wiring.publisher(topic),
                chains: chains.clone(),
            });
            GraphNode {
                inputs,
                outputs: outputs.collect(),
                stamp,
                ends: (!ends.is_empty()).then(|| wires.ends(wiring, &ends, alone)),
            }
        })
    }

    /// The topics that `node` publishes, each with the beginnings of the chains through it.
    fn outputs(
        &self,
        node: &NodeSpec,
        wires: &GraphWires,
    ) -> Vec<(Topic<Numbers>, Vec<Beginning>)> {
        let outputs = node.publishes.iter().filter_map(|Placed { text, .. }| {
            let mut topics = wires.topics.iter();
            let topic = topics.find(|topic| topic.name() == text)?;
            let chains = self.file.through(text);
            let chains = chains.map(|chain| self.beginning(node, chain, Some(text)));
            Some((topic.clone(), chains.collect()))
        });
        outputs.collect()
    }

    /// The chains that end at `node`.
    fn ends(&self, node: &NodeSpec) -> Vec<EndOf> {
        let ends = self.chains.iter().enumerate();
        let ends = ends.filter(|(_, chain)| chain.last() == node.name);
        ends.map(|(at, chain)| (at, chain.name, self.beginning(node, at, None)))
            .collect()
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
        if !self.is_own(before) {
            return Beginning::Sensing { input };
        }
        let place = self
            .file
            .through(before)
            .take_while(|other| *other != chain);
        let place = place.count();
        Beginning::Number { input, place }
    }
}

/// A chain that ends at a node: number, name, and beginning of the data.
type EndOf = (usize, &'static str, Beginning);

impl GraphWires {
    /// What the chains with these ends take. A system in the middle measures itself what it does:
    /// the nodes are `alone` without one.
    fn ends(&self, wiring: &mut Wiring<'_>, ends: &[EndOf], alone: bool) -> ChainEnds {
        let chains = ends.iter().map(|(number, name, beginning)| ChainEnd {
            number: *number,
            beginning: *beginning,
            meter: wiring.meter(name),
            begun: None,
        });
        let chains: Vec<_> = chains.collect();
        ChainEnds {
            acts: alone && chains.iter().any(|chain| chain.number == 0),
            chains,
            ages: self.ages.clone(),
            publisher: wiring.publisher(&self.chains),
        }
    }
}

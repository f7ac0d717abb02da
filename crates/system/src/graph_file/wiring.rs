//! The nodes of a graph file: wired to their topics, and what they do while they run.

use std::sync::Arc;

use ratelab::{
    Flow, MeterRecorder, Node, Publisher, Shared, Tick, TickResult, Time, Topic, Wiring,
};
use ratelab_metrics::RowReader;

use super::{GraphSystem, HeaderStamp, NodeSpec, error::Placed};
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

/// A node that reads, takes time and publishes.
pub(super) struct GraphNode {
    pub(super) inputs: Vec<NodeInput>,
    pub(super) outputs: Vec<Publisher<f64>>,
    pub(super) stamp: HeaderStamp,
    /// Whether it publishes only what it made of something new.
    pub(super) only_new: bool,
    /// Whether the present tick publishes.
    pub(super) published: bool,
    pub(super) ends: Option<ChainEnds>,
    /// The numbers of the message that it read last.
    pub(super) row: Vec<f64>,
}

/// An input, with what was read last.
pub(super) struct NodeInput {
    pub(super) reader: RowReader,
    /// Its header stamp; of a topic of a system, the time of the sensing behind it.
    pub(super) sensed: Option<Time>,
}

impl NodeInput {
    pub(super) fn new(reader: RowReader) -> Self {
        Self {
            reader,
            sensed: None,
        }
    }
}

/// The chains that end at a node.
pub(super) struct ChainEnds {
    pub(super) chains: Vec<ChainEnd>,
    pub(super) tracker: Arc<ChainTracker>,
    pub(super) ages: Arc<Shared<ChainAges>>,
    pub(super) publisher: Publisher<Numbers>,
    /// Whether the first chain of the file acts on the world: no system does.
    pub(super) acts: bool,
    /// When the present tick began.
    pub(super) began: Time,
}

/// The end of a chain.
pub(super) struct ChainEnd {
    pub(super) number: usize,
    /// The meter of its age at each output.
    pub(super) meter: MeterRecorder,
}

impl GraphNode {
    fn publish(&self, output: &Publisher<f64>, tick: &mut Tick) {
        let stamp = self.copied_stamp().unwrap_or_else(|| tick.stamp());
        tick.publish_stamped(output, stamp.as_nanos() as f64, stamp);
    }

    /// Returns the header stamp that it copies; `None` before there is one, and if it stamps by its
    /// clock.
    fn copied_stamp(&self) -> Option<Time> {
        match self.stamp {
            HeaderStamp::Now => None,
            HeaderStamp::Of(input) => self.inputs.get(input)?.sensed,
        }
    }
}

impl Node for GraphNode {
    fn tick(&mut self, tick: &mut Tick) -> TickResult {
        let mut is_new = false;
        for input in &mut self.inputs {
            if let Some(sensed) = (input.reader)(tick, &mut self.row) {
                is_new |= input.sensed != Some(sensed);
                input.sensed = Some(sensed);
            }
        }
        let mut inputs = self.inputs.iter();
        self.published = if self.only_new {
            is_new
        } else {
            self.inputs.is_empty() || inputs.any(|input| input.sensed.is_some())
        };
        if self.published {
            self.outputs
                .iter()
                .for_each(|output| self.publish(output, tick));
        }
        if let Some(ends) = &mut self.ends {
            ends.began = tick.now();
        }
        Ok(Flow::Continue)
    }

    /// Measures the chains when the messages of the tick are published.
    fn apply(&mut self, tick: &mut Tick) -> TickResult {
        let now = tick.now();
        let is_quiet = self.only_new && !self.published;
        let Some(ends) = self.ends.as_mut().filter(|_| !is_quiet) else {
            return Ok(Flow::Continue);
        };
        let (tracker, began) = (&ends.tracker, ends.began);
        let (mut outputs, mut first) = (Vec::new(), None);
        for end in &mut ends.chains {
            let begun = tracker.begun(end.number, began);
            if let Some(begun) = begun {
                end.meter.record(now.since(begun));
            }
            if end.number == 0 {
                first = begun;
            }
            outputs.push((end.number, begun));
        }
        if let Some(begun) = first.filter(|_| ends.acts) {
            tick.act_on(begun);
        }
        // The rows are in the order of their times, whichever node publishes them.
        let mut ages = ends.ages.lock();
        let row = ages.row(now, outputs);
        tick.publish_stamped(&ends.publisher, row, first);
        Ok(Flow::Continue)
    }
}

//! The nodes of a graph file around a system, and between a topic of it and its reader.

use std::sync::Arc;

use ratelab::Topology;

use super::{
    ChainSpec, GraphFile, HeaderStamp, InnerSpec, NodeSpec,
    error::{Checked, Placed, instead, refuse, unknown},
};
use crate::{Builder, ForwardingNode, Setup, System, WorldKind};

/// The system in the middle of a graph file.
pub(super) struct Middle {
    pub(super) system: Arc<dyn System>,
    /// The nodes of the file between its topics and their readers.
    pub(super) relays: Vec<ForwardingNode>,
}

/// Checks the graph of `file` around `system`.
pub(super) fn insert(
    file: &GraphFile,
    inner: &InnerSpec,
    system: Arc<dyn System>,
) -> Checked<Middle> {
    let setup = Setup::default();
    let mut around = Builder::new(0, &setup, WorldKind::Course);
    let built = system.build(&mut around);
    built.or_else(|why| refuse(inner.name.at, why.to_string()))?;
    let topology = around.graph.topology();
    let fit = Fit {
        file,
        around,
        topology,
    };
    fit.nodes()?;
    fit.settings()?;
    let relays = fit.relays(inner)?;
    for spec in &file.chains {
        fit.chain(spec, &relays)?;
    }
    Ok(Middle { system, relays })
}

/// A graph file around a system.
struct Fit<'f> {
    file: &'f GraphFile,
    /// What the system was built with.
    around: Builder<'f>,
    topology: Topology,
}

impl Fit<'_> {
    /// Checks that the names of the nodes and their topics are new, and their inputs known.
    fn nodes(&self) -> Checked {
        let file = self.file;
        let recorded = || self.around.recorded.iter().map(|topic| topic.name());
        for node in &file.nodes {
            if self.topology.node(&node.name).is_some() {
                let what = format!("the system has a node {:?} already", node.name);
                return refuse(node.at, format!("{what}: choose another name"));
            }
            let mut published = node.publishes.iter();
            let known = |topic: &&Placed| self.topology.topic(&topic.text).is_some();
            if let Some(topic) = published.find(known) {
                let what = format!("{:?} is a topic of the system", topic.text);
                return refuse(topic.at, format!("{what}: choose another name"));
            }
            let known = || file.published().chain(recorded());
            let mut inputs = node.inputs();
            inputs.try_for_each(|topic| one_of("no node publishes", topic, known()))?;
        }
        Ok(())
    }

    /// Checks that the nodes of executors and the topics with settings are of the file or of the
    /// system.
    fn settings(&self) -> Checked {
        let Topology { nodes, topics } = &self.topology;
        let nodes = self
            .file
            .names()
            .chain(nodes.iter().map(|node| &*node.name));
        let mut members = self.file.executors.iter().flat_map(|e| &e.nodes);
        members.try_for_each(|node| one_of("no node", node, nodes.clone()))?;
        let topics = topics.iter().map(|topic| &*topic.name);
        let topics = self.file.published().chain(topics);
        self.file
            .topics
            .iter()
            .try_for_each(|topic| one_of("no topic", topic, topics.clone()))
    }

    /// Returns the nodes between topics of the system and their readers.
    fn relays(&self, inner: &InnerSpec) -> Checked<Vec<ForwardingNode>> {
        let offered = &self.around.offered;
        let mut relays = Vec::new();
        for (from, to) in &inner.remap {
            if !offered.contains(&from.text) {
                let instead = instead(&from.text, offered.iter().map(String::as_str));
                let what = format!("{:?} has no reader that can be remapped", from.text);
                return refuse(from.at, format!("{what}: {instead}"));
            }
            relays.extend(self.line(from, to)?);
        }
        Ok(relays)
    }

    /// Checks the path of a chain where it goes through nodes of the system.
    fn chain(&self, spec: &ChainSpec, relays: &[ForwardingNode]) -> Checked {
        let is_relay = |name: &str| relays.iter().any(|relay| relay.node == name);
        let (first, last, name) = (&spec.path[0], spec.chain.last(), spec.chain.name());
        if self.topology.node(last).is_some() || is_relay(last) {
            let what = format!(
                "{name} ends at {last}, a node of the system or before one: expected another node \
                 of this file; the system measures the ages of its own actions"
            );
            return refuse(first.at, what);
        }
        for step in spec.path.windows(2) {
            let [from, to] = [&step[0], &step[1]];
            if !self.joins(from, to) {
                let what = format!("no way from {} to {}", from.text, to.text);
                return refuse(to.at, what);
            }
        }
        Ok(())
    }

    /// Returns whether a step of a path is one of the system; those of the file were checked
    /// before.
    fn joins(&self, from: &Placed, to: &Placed) -> bool {
        let reading = from.is_topic();
        let (node, topic) = if reading { (to, from) } else { (from, to) };
        if self.file.node(&node.text).is_some() {
            return true;
        }
        let Topology { topics, .. } = &self.topology;
        self.topology
            .node(&node.text)
            .zip(self.topology.topic(&topic.text))
            .is_some_and(|(node, topic)| {
                if reading {
                    topics[topic].readers.contains(&node)
                } else {
                    topics[topic].publishers.contains(&node)
                }
            })
    }

    /// Returns the nodes on the way from the topic `from` of the system to the topic `to`, in the
    /// order of the data.
    fn line(&self, from: &Placed, to: &Placed) -> Checked<Vec<ForwardingNode>> {
        let mut relays: Vec<ForwardingNode> = Vec::new();
        let mut topic = &to.text;
        let no_way = |why: String| {
            let what = format!("{:?} is no way from {:?}: {why}", to.text, from.text);
            refuse(to.at, what)
        };
        while *topic != from.text {
            let publishers: Vec<_> = self
                .file
                .nodes
                .iter()
                .filter(|node| node.publishes(topic))
                .collect();
            let [node] = publishers[..] else {
                let count = publishers.len();
                return no_way(format!("{count} nodes publish {topic:?}, expected one"));
            };
            let input = self.single_input(node, from, to)?;
            if relays.iter().any(|relay| relay.node == node.name) {
                return no_way("a circle".to_owned());
            }
            relays.push(ForwardingNode {
                node: node.name.clone(),
                release: node.release,
                from: input.text.clone(),
                to: topic.clone(),
            });
            topic = &input.text;
        }
        relays.reverse();
        Ok(relays)
    }

    /// Returns the one input of a node between the topic `from` and its reader.
    fn single_input<'n>(
        &self,
        node: &'n NodeSpec,
        from: &Placed,
        to: &Placed,
    ) -> Checked<&'n Placed> {
        let (name, from) = (&node.name, &from.text);
        let inputs: Vec<&Placed> = node.inputs().collect();
        let what = match (&inputs[..], node.publishes.len(), node.priority) {
            ([_], 1, None) if node.stamp == HeaderStamp::Now => format!(
                "{name} passes on the time of the reading from {from:?}: leave its stamp out"
            ),
            ([input], 1, None) => return Ok(input),
            ([_], 1, Some(_)) => format!(
                "{name} ticks right behind the publisher of {from:?}: leave its priority out"
            ),
            _ => format!(
                "{name} is between {from:?} and its reader: expected a node that reads one topic \
                 and publishes one"
            ),
        };
        refuse(to.at, what)
    }
}

/// Refuses a name that is none of the `known` ones.
fn one_of<'n>(no: &str, name: &Placed, known: impl Iterator<Item = &'n str> + Clone) -> Checked {
    if known.clone().any(|known| known == name.text) {
        Ok(())
    } else {
        unknown(no, name, known)
    }
}

//! The node and the topics whose knobs keys turn.

use ratelab::KnobKind;
use ratelab_account::{NodeAccount, Snapshot, TopicAccount};
use ratelab_study::system::System;

use super::presets::{Direction, neighbour};
use crate::names::{first_alias, paced_node};

/// The node whose rate keys turn, and the topics whose depths they turn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct KnobFocus {
    /// Name of the node.
    pub node: String,
    /// Names of the topics.
    pub topics: Vec<String>,
}

impl KnobFocus {
    /// The node and the topics of the first aliases of `system`; without aliases the
    /// node with the most connections, and all topics with readers.
    pub fn new(system: &dyn System, graph: &Snapshot) -> Self {
        let node = first_node(system, graph);
        Self {
            node: node.map_or_else(String::new, |node| node.name.to_string()),
            topics: first_topics(system, graph),
        }
    }

    /// Goes to the next node of `graph`, or the one before.
    pub fn move_node(&mut self, graph: &Snapshot, direction: Direction) {
        let names: Vec<&str> = graph.nodes.iter().map(|node| &*node.name).collect();
        let at = names.iter().position(|name| *name == self.node);
        if let Some(at) = neighbour(at, names.len(), direction) {
            names[at].clone_into(&mut self.node);
        }
    }

    /// Goes to the next topic of `graph` with readers, or the one before; after the
    /// last to the topics of the beginning.
    pub fn move_topic(&mut self, system: &dyn System, graph: &Snapshot, direction: Direction) {
        let first = first_topics(system, graph);
        let single = read(graph).map(|topic| vec![topic.name.to_string()]);
        let mut places: Vec<Vec<String>> = single.filter(|topics| *topics != first).collect();
        places.insert(0, first);
        let at = places.iter().position(|topics| *topics == self.topics);
        if let Some(at) = neighbour(at, places.len(), direction) {
            self.topics = places.swap_remove(at);
        }
    }
}

/// The node of the first alias for a rate; without one the node at a rate with the most
/// inputs and outputs, the plant last among equals.
pub fn first_node<'g>(system: &dyn System, graph: &'g Snapshot) -> Option<&'g NodeAccount> {
    if let Some(node) = paced_node(system).and_then(|name| graph.node(name)) {
        return Some(node);
    }
    let ends = |node: usize| {
        let ends = graph.topics.iter().flat_map(|topic| {
            let readers = topic.readers.iter().map(|reader| reader.node);
            topic.publishers.iter().copied().chain(readers)
        });
        ends.filter(|end| *end == node).count()
    };
    let states = system.state().and_then(|name| graph.topic(name));
    let makes_states = |node| states.is_some_and(|topic| topic.publishers.contains(&node));
    let nodes = graph.nodes.iter().enumerate().rev();
    nodes
        .max_by_key(|(index, node)| {
            let paced = node.triggers.is_empty();
            (paced, ends(*index), !makes_states(*index))
        })
        .map(|(_, node)| node)
}

/// The topics of the first alias for a depth; without one all topics with readers.
fn first_topics(system: &dyn System, graph: &Snapshot) -> Vec<String> {
    match first_alias(system, KnobKind::Depth) {
        Some(alias) => alias
            .knobs
            .iter()
            .map(|(_, name)| (*name).to_owned())
            .collect(),
        None => read(graph).map(|topic| topic.name.to_string()).collect(),
    }
}

fn read(graph: &Snapshot) -> impl Iterator<Item = &TopicAccount> {
    graph
        .topics
        .iter()
        .filter(|topic| !topic.readers.is_empty())
}

//! The topology of a graph: nodes, topics and their edges, without figures.

use serde::{Deserialize, Serialize};

use crate::{
    qos::Depth,
    settings::{as_text, release::Match},
    time::Hz,
};

/// Nodes, topics and connections: enough to draw a graph or to replay its run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Topology {
    /// The nodes, in the order of addition.
    pub nodes: Vec<NodeTopology>,
    /// The topics, in the order of their first connection.
    pub topics: Vec<TopicTopology>,
}

/// A node of a [`Topology`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NodeTopology {
    /// Its name.
    pub name: String,
    /// Priority among nodes that are due at the same instant, lowest first.
    pub priority: u32,
    /// Its rate; that of the messages if they trigger it.
    pub hz: Hz,
    /// The topics that trigger it, as indices into [`Topology::topics`].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub triggers: Vec<usize>,
    /// What a tick needs of several triggers.
    #[serde(with = "as_text", default, skip_serializing_if = "Match::is_each")]
    pub matching: Match,
    /// Name of its executor, if it has no thread of its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub executor: Option<String>,
    /// Number of that executor in the graph, if its nodes share threads.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub executor_index: Option<usize>,
    /// Its mutually exclusive callback group there, if it shares one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub group: Option<String>,
    /// Names of its own measurements.
    pub meters: Vec<String>,
}

/// A topic of a [`Topology`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TopicTopology {
    /// Its name.
    pub name: String,
    /// Queue depth.
    pub depth: Depth,
    /// The nodes that publish to it, as indices into [`Topology::nodes`].
    pub publishers: Vec<usize>,
    /// The nodes that read from it, as indices.
    pub readers: Vec<usize>,
}

impl Topology {
    /// Returns the index of the node called `name`.
    pub fn node(&self, name: &str) -> Option<usize> {
        self.nodes.iter().position(|node| node.name == name)
    }

    /// Returns the index of the topic called `name`.
    pub fn topic(&self, name: &str) -> Option<usize> {
        self.topics.iter().position(|topic| topic.name == name)
    }

    /// Returns the rate in force of each node, a node with a timer has its `own`; see
    /// [`ticks_per_second`](Self::ticks_per_second).
    pub fn rates(&self, own: impl Fn(usize) -> Hz) -> Vec<Hz> {
        self.micro_rates(own).map(Hz::from_micro).collect()
    }

    /// Returns the ticks per second of each node, a node with a timer has its `own`. For a node
    /// that messages trigger it is that of the messages: of all publishers of a topic together,
    /// and of several topics the slowest. They may be more than one node's rate can be.
    pub fn ticks_per_second(&self, own: impl Fn(usize) -> Hz) -> Vec<f64> {
        let rates = self.micro_rates(own).map(|micro| micro as f64 / 1e6);
        rates.collect()
    }

    /// These rates in microhertz.
    fn micro_rates(&self, own: impl Fn(usize) -> Hz) -> impl Iterator<Item = u64> {
        let nodes = self.nodes.iter().enumerate();
        let mut known: Vec<Option<u64>> = nodes
            .map(|(index, node)| node.triggers.is_empty().then(|| own(index).as_micro()))
            .collect();
        for node in 0..self.nodes.len() {
            self.find_rate(node, &mut known);
        }
        known.into_iter().map(Option::unwrap_or_default)
    }

    /// Finds the rate of a node, after the rates of all nodes before it in chains of triggers.
    fn find_rate(&self, node: usize, known: &mut [Option<u64>]) {
        let mut path = vec![node];
        while let Some(&node) = path.last() {
            let triggers = self.nodes[node].triggers.iter();
            let mut before = triggers.flat_map(|topic| &self.topics[*topic].publishers);
            // A graph has no circle of triggers, but a damaged recording of one may.
            match before.find(|publisher| known[**publisher].is_none()) {
                Some(unknown) if known[node].is_none() && !path.contains(unknown) => {
                    path.push(*unknown);
                }
                _ => {
                    let rate = self.rate_of_messages(node, known);
                    known[node].get_or_insert(rate);
                    path.pop();
                }
            }
        }
    }

    fn rate_of_messages(&self, node: usize, known: &[Option<u64>]) -> u64 {
        let topics = self.nodes[node].triggers.iter();
        let rates = topics.map(|topic| {
            self.topics[*topic]
                .publishers
                .iter()
                .filter_map(|publisher| known[*publisher])
                .sum::<u64>()
        });
        let every = match self.nodes[node].matching {
            Match::Every { sets } => sets.get() as u64,
            _ => 1,
        };
        let slowest: u64 = rates.min().unwrap_or_default();
        slowest / every
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_circle_of_triggers_has_no_rate_and_ends_the_search() {
        let node = |name: &str, trigger| NodeTopology {
            name: name.to_owned(),
            priority: 0,
            hz: Hz::MIN,
            triggers: vec![trigger],
            matching: Match::Each,
            executor: None,
            executor_index: None,
            group: None,
            meters: Vec::new(),
        };
        let topic = |name: &str, publisher, reader| TopicTopology {
            name: name.to_owned(),
            depth: Depth::ONE,
            publishers: vec![publisher],
            readers: vec![reader],
        };
        let topology = Topology {
            nodes: vec![node("a", 1), node("b", 0)],
            topics: vec![topic("/a", 0, 1), topic("/b", 1, 0)],
        };
        assert_eq!(topology.ticks_per_second(|_| Hz::MIN), [0.0, 0.0]);
    }
}

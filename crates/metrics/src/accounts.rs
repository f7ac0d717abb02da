//! The accounts of a run, and their copy at one moment.

use std::time::Duration;

use ratelab::{
    Graph, Status, Time, Topology,
    sync::{Mutex, MutexGuard, lock},
};

use crate::{distribution::Distribution, node::NodeAccount, topic::TopicAccount};

/// The accounts of all nodes and topics of a run, by their indices: the one fold over its
/// records. Each has a lock of its own, which a record and a look hold for a moment.
#[derive(Debug)]
pub(crate) struct Accounts {
    /// The graph before the first record.
    pub(crate) topology: Topology,
    nodes: Vec<Mutex<NodeAccount>>,
    topics: Vec<Mutex<TopicAccount>>,
}

impl Accounts {
    /// Accounts before the first record for a graph with this `topology`, all of whose nodes run
    /// here.
    pub(crate) fn new(topology: Topology) -> Self {
        let nodes = topology.nodes.iter().map(NodeAccount::new);
        let topics = topology.topics.iter().map(TopicAccount::new);
        Self {
            nodes: nodes.map(Mutex::new).collect(),
            topics: topics.map(Mutex::new).collect(),
            topology,
        }
    }

    /// Accounts for a graph as it is.
    pub(crate) fn from_graph(graph: &Graph) -> Self {
        let accounts = Self::new(graph.topology());
        for (index, node) in accounts.nodes.iter().enumerate() {
            let mut node = lock(node);
            node.crashed = graph.is_crashed(index);
            node.remote = !graph.is_here(index);
        }
        accounts
    }

    /// Returns the account of a node. Nodes that were added to the graph later have none.
    pub(crate) fn node(&self, index: usize) -> Option<MutexGuard<'_, NodeAccount>> {
        self.nodes.get(index).map(lock)
    }

    /// Returns the account of a topic. Topics that were added to the graph later have none.
    pub(crate) fn topic(&self, index: usize) -> Option<MutexGuard<'_, TopicAccount>> {
        self.topics.get(index).map(lock)
    }

    /// Returns all accounts, at run time `now`.
    pub(crate) fn snapshot(&self, now: Time, status: Status) -> Snapshot {
        let nodes = self.nodes.iter().map(|node| lock(node).clone());
        let mut nodes: Vec<NodeAccount> = nodes.collect();
        let rates = self.topology.rates(|node| nodes[node].hz);
        nodes
            .iter_mut()
            .zip(rates)
            .for_each(|(node, hz)| node.hz = hz);
        Snapshot {
            now,
            status,
            nodes,
            topics: self
                .topics
                .iter()
                .map(|topic| lock(topic).clone())
                .collect(),
        }
    }
}

/// A graph with its accounts at one moment: structure and figures, without locks.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// Run time of the last tick or command.
    pub now: Time,
    /// The state of the graph's clock.
    pub status: Status,
    /// The nodes, in the order of addition.
    pub nodes: Vec<NodeAccount>,
    /// The topics, in the order of their first connection.
    pub topics: Vec<TopicAccount>,
}

impl Snapshot {
    /// Returns the node called `name`.
    pub fn node(&self, name: &str) -> Option<&NodeAccount> {
        self.nodes.iter().find(|node| &*node.name == name)
    }

    /// Returns the measurement `name` of the node called `node`.
    pub fn meter(&self, node: &str, name: &str) -> Option<&Distribution> {
        self.node(node)?.meter(name)
    }

    /// Returns the period of the node called `name`; zero if there is none.
    pub fn period(&self, name: &str) -> Duration {
        self.node(name)
            .map_or(Duration::ZERO, |node| node.hz.period())
    }

    /// Returns the topic called `name`.
    pub fn topic(&self, name: &str) -> Option<&TopicAccount> {
        self.topics.iter().find(|topic| &*topic.name == name)
    }
}

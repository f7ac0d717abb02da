//! The topology of a graph: nodes, topics and their edges, without figures.

use serde::{Deserialize, Serialize};

use super::Observer;
use crate::{depth::Depth, executor::Executor, sync::atomic::Ordering, time::Hz, trigger::Match};

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
    #[serde(default, skip_serializing_if = "is_each")]
    pub matching: Match,
    /// Its executor, if it has no thread of its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub executor: Option<Executor>,
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

fn is_each(matching: &Match) -> bool {
    *matching == Match::Each
}

impl Observer {
    /// The current topology of the graph.
    pub fn topology(&self) -> Topology {
        let nodes = self.nodes.iter().zip(self.rates());
        let nodes = nodes.map(|(node, hz)| NodeTopology {
            name: node.name.to_string(),
            priority: node.priority,
            hz,
            triggers: node.triggers.to_vec(),
            matching: node.matching,
            executor: node.executor,
            executor_index: node.executor_index,
            group: node.group.as_deref().map(str::to_owned),
            meters: node.meters.iter().map(|(name, _)| name.clone()).collect(),
        });
        let topics = self.topics.iter().map(|topic| TopicTopology {
            name: topic.name.to_string(),
            depth: Depth::known(topic.counters.depth.load(Ordering::Relaxed)),
            publishers: topic.publishers.clone(),
            readers: topic.subscriptions.iter().map(|s| s.node).collect(),
        });
        Topology {
            nodes: nodes.collect(),
            topics: topics.collect(),
        }
    }
}

//! A run of other processes for a recorder: its messages and ticks as they are put together.

use ratelab::{Head, Topology};
use ratelab_account::{Copies, RowTap, Tap, TickRecord};
use ratelab_study::experiment::Taps;

use ratelab_recording::Tapped;

/// Passes on messages and ticks to whoever taps them.
pub struct Relay {
    topics: Vec<RelayedTopic>,
    nodes: Vec<Copies<TickRecord>>,
}

struct RelayedTopic {
    name: String,
    /// `None` for a topic that is not recorded.
    fields: Option<Fields>,
    messages: Copies<(Head, Vec<f64>)>,
}

/// Names of the numbers in a message.
type Fields = &'static [&'static str];

impl Relay {
    /// A relay for a graph with this `topology`, of which the topics that are `known` are
    /// recorded.
    pub fn new(topology: &Topology, known: &Taps) -> Self {
        let topics = topology.topics.iter().map(|topic| RelayedTopic {
            fields: known.fields(&topic.name),
            name: topic.name.clone(),
            messages: Copies::default(),
        });
        Self {
            topics: topics.collect(),
            nodes: topology.nodes.iter().map(|_| Copies::default()).collect(),
        }
    }

    /// Passes on a message of the topic with index `topic`, and that some are `missing`
    /// before it.
    pub fn message(&self, topic: usize, head: Head, row: &[f64], missing: u64) {
        if let Some(topic) = self.topics.get(topic) {
            topic.messages.lose(missing);
            topic.messages.offer(&(head, row.to_vec()));
        }
    }

    /// Passes on a tick of the node with index `node`, and that some are `missing` before
    /// it.
    pub fn tick(&self, node: usize, tick: TickRecord, missing: u64) {
        if let Some(node) = self.nodes.get(node) {
            node.lose(missing);
            node.offer(&tick);
        }
    }

    fn topic(&self, name: &str) -> Option<(&RelayedTopic, Fields)> {
        let topic = self.topics.iter().find(|topic| topic.name == name)?;
        Some((topic, topic.fields?))
    }
}

impl Tapped for Relay {
    fn fields(&self, topic: &str) -> Option<Fields> {
        self.topic(topic).map(|(_, fields)| fields)
    }

    fn rows(&self, topic: &str, capacity: usize) -> Option<RowTap> {
        let (topic, fields) = self.topic(topic)?;
        Some(RowTap::of(topic.messages.tap(capacity), fields.len()))
    }

    fn ticks(&self, capacity: usize) -> Vec<Tap<TickRecord>> {
        self.nodes.iter().map(|node| node.tap(capacity)).collect()
    }
}

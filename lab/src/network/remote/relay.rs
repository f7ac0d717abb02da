//! A run of other processes for a recorder: its messages and ticks as they are put together.

use ratelab::{Head, Topology};
use ratelab_experiment::Taps;
use ratelab_metrics::{Copies, RunRow, Tap, TickRecord};

use ratelab_recording::Tapped;

/// Passes on messages and ticks to whoever taps them.
pub struct Relay {
    topics: Vec<RelayedTopic>,
    /// Number of nodes.
    nodes: usize,
    rows: Copies<RunRow>,
}

struct RelayedTopic {
    name: String,
    /// `None` for a topic that is not recorded.
    fields: Option<Vec<String>>,
}

impl Relay {
    /// A relay for a graph with this `topology`, of which the topics that are `known` are
    /// recorded.
    pub fn new(topology: &Topology, known: &Taps) -> Self {
        let topics = topology.topics.iter().map(|topic| RelayedTopic {
            fields: known.fields(&topic.name).map(<[String]>::to_vec),
            name: topic.name.clone(),
        });
        Self {
            topics: topics.collect(),
            nodes: topology.nodes.len(),
            rows: Copies::default(),
        }
    }

    /// Passes on a message of the topic with index `topic`, and that some are `missing`
    /// before it.
    pub fn message(&self, topic: usize, head: Head, row: &[f64], missing: u64) {
        let known = self.topics.get(topic);
        if known.is_some_and(|topic| topic.fields.is_some()) {
            self.pass(RunRow::Message(topic, head, row.to_vec()), missing);
        }
    }

    /// Passes on a tick of the node with index `node`, and that some are `missing` before
    /// it.
    pub fn tick(&self, node: usize, tick: TickRecord, missing: u64) {
        if node < self.nodes {
            self.pass(RunRow::Tick(node, tick), missing);
        }
    }

    fn pass(&self, row: RunRow, missing: u64) {
        self.rows.lose(missing);
        self.rows.offer(&row);
    }
}

impl Tapped for Relay {
    fn fields(&self, topic: &str) -> Option<&[String]> {
        let mut topics = self.topics.iter();
        topics.find(|known| known.name == topic)?.fields.as_deref()
    }

    fn all(&self, capacity: usize) -> Tap<RunRow> {
        self.rows.tap(capacity)
    }
}

//! The table of a node: a row for each tick.

use ratelab_metrics::{TickRecord, TracedTick, nanos, sensing_of};

use super::{RunTables, between, milliseconds, owned, seconds};

/// The columns of every node, before the columns of what it reads.
const COLUMNS: [&str; 7] = [
    "tick",
    "time_s",
    "due_s",
    "lateness_ms",
    "took_ms",
    "ends_s",
    "overruns",
];

/// The columns of a topic that is read.
const READS: [&str; 3] = ["seq", "sensed_s", "age_ms"];

/// The columns of a node that acts on the world.
const ACTS: [&str; 3] = ["acts_s", "acts_on_sensed_s", "push_age_ms"];

impl RunTables {
    /// Returns the columns of the node with this index.
    pub(super) fn node_columns(&self, node: usize) -> Vec<String> {
        let topics = &self.recording.origin.topology.topics;
        let reads = self
            .inputs(node)
            .into_iter()
            .flat_map(|topic| READS.map(|what| format!("read {} {what}", topics[topic].name)));
        let acts = if self.acts(node) { &ACTS[..] } else { &[] };
        let columns = owned(&COLUMNS).into_iter().chain(reads);
        columns.chain(owned(acts)).collect()
    }

    /// Returns the topics that a node reads, by their indices, as far as they are recorded.
    fn inputs(&self, node: usize) -> Vec<usize> {
        let topics = self
            .recording
            .origin
            .topology
            .topics
            .iter()
            .zip(&self.recording.topics)
            .enumerate();
        let inputs =
            topics.filter(|(_, (topic, rows))| topic.readers.contains(&node) && !rows.is_empty());
        inputs.map(|(topic, _)| topic).collect()
    }

    /// Returns whether a node acts on the world.
    fn acts(&self, node: usize) -> bool {
        let mut ticks = self.recording.ticks[node].iter();
        ticks.any(|tick| tick.push.is_some())
    }

    /// Returns the ticks of a node.
    pub(super) fn ticks(&self, node: usize) -> Vec<Vec<String>> {
        let (inputs, acts) = (self.inputs(node), self.acts(node));
        let rows = self.lineage.ticks(node).map(|worked| {
            let reads = inputs.iter().flat_map(|topic| self.read(*topic, worked));
            let action = acts.then(|| action(&worked.tick));
            timing(&worked.tick)
                .into_iter()
                .chain(reads)
                .chain(action.into_iter().flatten())
                .collect()
        });
        rows.collect()
    }

    /// Returns what a tick read of a topic: the message, and how old its data were then.
    fn read(&self, topic: usize, worked: &TracedTick) -> [String; READS.len()] {
        let mut reads = worked.reads();
        let read = reads.find(|read| read.topic == topic);
        let heads = self.recording.topics[topic].heads();
        let cells = read
            .and_then(|read| {
                let index = heads.partition_point(|head| head.seq < read.seq);
                heads.get(index).filter(|head| head.seq == read.seq)
            })
            .map(|head| {
                let sensed = sensing_of(head);
                let age = between(sensed, worked.tick.at);
                [head.seq.to_string(), seconds(sensed), age]
            });
        cells.unwrap_or_default()
    }
}

/// Returns when a tick was due, began and ended.
fn timing(tick: &TickRecord) -> [String; COLUMNS.len()] {
    let took = tick.took.map(|took| milliseconds(nanos(took)));
    let until_end = || tick.ends.map(|ends| between(tick.at, ends));
    [
        tick.number.to_string(),
        seconds(tick.at),
        seconds(tick.due()),
        between(tick.due(), tick.at),
        took.or_else(until_end).unwrap_or_default(),
        tick.ends.map(seconds).unwrap_or_default(),
        tick.overruns.to_string(),
    ]
}

/// Returns what a tick did to the world.
fn action(tick: &TickRecord) -> [String; ACTS.len()] {
    let cells = tick.push.map(|push| {
        let age = between(push.sensed, push.at);
        [seconds(push.at), seconds(push.sensed), age]
    });
    cells.unwrap_or_default()
}

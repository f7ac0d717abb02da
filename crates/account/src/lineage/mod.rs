//! The messages and ticks behind an action, and the parts of its age.
//!
//! A running graph stores none of this: it follows from the output of taps, or from a
//! recording. A graph without taps pays nothing for it.

mod meeting;
mod parts;
mod push;
mod reads;
mod sentence;
mod waits;

use std::collections::VecDeque;

pub use parts::{AgePart, AgeParts, AgeStage, nanos};
pub use push::{Chain, PushInForce};
pub use waits::{TickWait, WaitsFor};

use ratelab::{Depth, Event, Head, Knob, ReadOrder, Time, TimedKnob, Topology};
use ratelab_effects::Executor;

use self::meeting::Meeting;
use super::node::TickRecord;

/// The messages and ticks of a run, with the reads of each tick.
///
/// Given all messages and ticks, in the order of each topic and node, it finds the chain
/// behind every action. Reads are as exact as the timestamps: in virtual time to the
/// nanosecond.
#[derive(Clone, Debug)]
pub struct Lineage {
    topology: Topology,
    topics: Vec<TracedTopic>,
    nodes: Vec<TracedNode>,
    /// The topics on the way of the data to the node that acts, the sensor first; empty if the
    /// times of the sensing tell it.
    path: Vec<usize>,
    /// Whether that is another way than the one of the measured pushes.
    beside: bool,
    /// Number of messages and ticks kept per topic and node.
    kept: usize,
}

/// A topic and its messages.
#[derive(Clone, Debug)]
struct TracedTopic {
    sent: VecDeque<Head>,
    /// Read order and queue depth, with the run time from which they are in force.
    rules: Vec<(Time, ReadOrder, Depth)>,
}

/// A node and its ticks.
#[derive(Clone, Debug, Default)]
struct TracedNode {
    /// Its executor, if it has no thread of its own.
    executor: Option<Executor>,
    /// Indices of the topics that it reads.
    inputs: Vec<usize>,
    ticks: VecDeque<TracedTick>,
    /// Number of these ticks with known reads.
    settled: usize,
    /// What it has taken, if several topics trigger it.
    meeting: Option<Meeting>,
}

/// Time of the sensing that a message was derived from, by the clock of that stamp.
pub fn sensing_of(head: &Head) -> Time {
    head.origin.unwrap_or(head.stamp)
}

/// A tick of a node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TracedTick {
    /// The tick.
    pub tick: TickRecord,
    /// The message read from each of the node's inputs: the topic, and the sequence
    /// number.
    pub reads: Vec<(usize, u64)>,
}

impl TracedTick {
    /// Run time of its end, when it publishes and acts; [`Time::MAX`] if the run ended
    /// before.
    fn ends(&self) -> Time {
        self.tick.ends.unwrap_or(Time::MAX)
    }

    /// Sequence number of the message that it read from the topic with this index.
    fn read(&self, topic: usize) -> Option<u64> {
        let mut reads = self.reads.iter();
        reads
            .find(|(known, _)| *known == topic)
            .map(|(_, seq)| *seq)
    }
}

impl Lineage {
    /// Creates an empty lineage for a graph of this `topology`, whose run begins with the knobs
    /// of `setup`.
    pub fn new<'k>(topology: Topology, setup: impl IntoIterator<Item = &'k Knob>) -> Self {
        let topics = topology.topics.iter().map(|topic| TracedTopic {
            sent: VecDeque::new(),
            rules: vec![(Time::ZERO, ReadOrder::Newest, topic.depth)],
        });
        let nodes = (0..topology.nodes.len()).map(|node| {
            let topics = topology.topics.iter().enumerate();
            let inputs = topics.filter(|(_, topic)| topic.readers.contains(&node));
            let executor = topology.nodes[node].executor.as_ref();
            TracedNode {
                inputs: inputs.map(|(index, _)| index).collect(),
                executor: executor.and_then(|name| name.parse().ok()),
                ..TracedNode::default()
            }
        });
        let mut lineage = Self {
            topics: topics.collect(),
            nodes: nodes.collect(),
            topology,
            path: Vec::new(),
            beside: false,
            kept: usize::MAX,
        };
        for knob in setup {
            lineage.knob(Time::ZERO, knob);
        }
        lineage
    }

    /// Returns the same lineage with this number of the newest messages and ticks kept
    /// per topic and node.
    #[must_use]
    pub fn keeping(self, kept: usize) -> Self {
        Self { kept, ..self }
    }

    /// Returns the same lineage with the names of the topics on the way of the data to the
    /// node that acts, the sensor first. Where readings meet, it tells which of them counts.
    #[must_use]
    pub fn along(self, path: &[impl AsRef<str>]) -> Self {
        let path = self.places(path).unwrap_or_default();
        Self { path, ..self }
    }

    /// The indices of topics by their names.
    fn places(&self, names: &[impl AsRef<str>]) -> Option<Vec<usize>> {
        let places = names.iter().map(|name| self.topology.topic(name.as_ref()));
        places.collect()
    }

    /// Goes another way from now on: along the topics of this `path`, the sensor's first, whatever
    /// pushes its last node measures; by the times of the sensing if it is empty. Returns `false`
    /// if the graph lacks one of them.
    pub fn go_along(&mut self, path: &[impl AsRef<str>]) -> bool {
        let path = self.places(path);
        let known = path.is_some();
        self.path = path.unwrap_or_default();
        self.beside = !self.path.is_empty();
        known
    }

    /// The graph.
    pub fn topology(&self) -> &Topology {
        &self.topology
    }

    /// Adds a message published to the topic with index `topic`.
    pub fn message(&mut self, topic: usize, head: &Head) {
        if let Some(topic) = self.topics.get_mut(topic) {
            topic.sent.push_back(*head);
            if topic.sent.len() > self.kept {
                topic.sent.pop_front();
            }
        }
    }

    /// Adds a tick of the node with index `node`.
    pub fn tick(&mut self, node: usize, tick: TickRecord) {
        if let Some(node) = self.nodes.get_mut(node) {
            let reads = Vec::new();
            node.ticks.push_back(TracedTick { tick, reads });
            if node.ticks.len() > self.kept {
                node.ticks.pop_front();
                node.settled = node.settled.saturating_sub(1);
            }
        }
    }

    /// Adds an event: a knob may change what is read.
    pub fn event(&mut self, event: &Event) {
        if let Some(TimedKnob { at, knob }) = event.knob() {
            self.knob(at, &knob);
        }
    }

    fn knob(&mut self, at: Time, knob: &Knob) {
        let Some(topic) = self.topology.topic(knob.target()) else {
            return;
        };
        let rules = &mut self.topics[topic].rules;
        let Some(&(_, order, depth)) = rules.last() else {
            return;
        };
        match knob {
            Knob::Read { order, .. } => rules.push((at, *order, depth)),
            Knob::Depth { depth, .. } => rules.push((at, order, *depth)),
            _ => {}
        }
    }

    /// Finds the reads of all ticks that have none yet. To be called after all messages
    /// are added that these ticks could read.
    pub fn settle(&mut self) {
        for node in 0..self.nodes.len() {
            for index in self.nodes[node].settled..self.nodes[node].ticks.len() {
                let reads = self.reads_of(node, index);
                self.nodes[node].ticks[index].reads = reads;
            }
            self.nodes[node].settled = self.nodes[node].ticks.len();
        }
    }

    /// The ticks of the node with index `node`, oldest first.
    pub fn ticks(&self, node: usize) -> impl DoubleEndedIterator<Item = &TracedTick> {
        self.nodes[node].ticks.iter()
    }

    /// The ticks of a node that were running between two run times, and the one before
    /// them, each with its index.
    pub fn ticks_between(
        &self,
        node: usize,
        from: Time,
        to: Time,
    ) -> impl Iterator<Item = (usize, &TracedTick)> {
        let ticks = &self.nodes[node].ticks;
        let first = ticks.partition_point(|worked| worked.ends() < from);
        let last = ticks.partition_point(|worked| worked.tick.at <= to);
        let first = first.saturating_sub(1).min(last);
        (first..last).zip(ticks.range(first..last))
    }

    /// The messages of the topic with index `topic`, oldest first.
    pub fn sent(&self, topic: usize) -> impl DoubleEndedIterator<Item = &Head> {
        self.topics[topic].sent.iter()
    }
}

//! The messages and ticks behind an action, and the parts of its age.
//!
//! A running graph stores none of this: it follows from the output of taps, or from a
//! recording. A graph without taps pays nothing for it.

mod causes;
mod over_time;
mod parts;
mod push;
mod waits;

use std::collections::VecDeque;

pub use over_time::{AgeOverTime, mean_parts};
pub use parts::{AgePart, AgeParts, AgeStage, nanos};
pub use push::{Chain, PushInForce};
pub use waits::{TickWait, WaitsFor};

use ratelab::{Depth, Event, Executor, Head, Knob, MessageId, Time, TimeSpan, TimedKnob, Topology};
use smallvec::SmallVec;

use self::causes::Beginnings;
use super::node::TickRecord;
use crate::tap_handle::RunRow;

/// The messages and ticks of a run, joined by their causes.
///
/// A message names the tick that published it, and a tick names the messages that it read: so the
/// chain behind every action is exact, under both clocks, in a run and in its recording.
#[derive(Clone, Debug)]
pub struct Lineage {
    topology: Topology,
    topics: Vec<TracedTopic>,
    nodes: Vec<TracedNode>,
    way: DataWay,
    /// Whether that is another way than the one of the measured pushes.
    beside: bool,
    /// Number of messages and ticks kept per topic and node.
    kept: usize,
}

/// The way of the data that counts.
#[derive(Clone, Debug)]
enum DataWay {
    /// Along these topics, the sensor's first, to the node that acts.
    Along(Vec<usize>),
    /// By the newest data of this node that began some; of the first one that did, if it is `None`.
    FromSource(Option<usize>),
}

/// A topic and its messages.
#[derive(Clone, Debug)]
struct TracedTopic {
    sent: VecDeque<Head>,
    /// The queue depth, with the run time from which it is in force.
    depths: Vec<(Time, Depth)>,
}

/// A node and its ticks.
#[derive(Clone, Debug, Default)]
struct TracedNode {
    /// Its executor, if it has no thread of its own.
    executor: Option<Executor>,
    /// Whether it reads nothing, and so begins data.
    begins: bool,
    /// Whether any of its actions is recorded.
    acts: bool,
    ticks: VecDeque<TracedTick>,
    /// Number of these ticks with known beginnings of their data.
    settled: usize,
}

/// What is older than that (ns) is kept only if little is: data behind an action are seldom older.
const KEPT_NS: u64 = 60_000_000_000;

fn is_long_before(oldest: Time, newest: Time) -> bool {
    newest.as_nanos().saturating_sub(oldest.as_nanos()) > KEPT_NS
}

/// Returns whether the oldest item makes room for another one.
fn is_over<T>(items: &VecDeque<T>, kept: usize, is_old: impl FnOnce(&T) -> bool) -> bool {
    let is_oldest_old = || items.front().is_some_and(is_old);
    items.len() >= kept || items.len() >= kept / 8 && is_oldest_old()
}

/// Messages of different topics: most nodes read few.
type Reads = SmallVec<[MessageId; 2]>;

/// Adds a message, unless one of its topic is there.
fn add_read(reads: &mut Reads, read: MessageId) {
    if reads.iter().all(|known| known.topic != read.topic) {
        reads.push(read);
    }
}

/// A tick, by its place among the known ticks of its node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TickPlace {
    /// Index of the node.
    pub node: usize,
    /// Index of the tick.
    pub index: usize,
}

/// A tick of a node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TracedTick {
    /// The tick.
    pub tick: TickRecord,
    /// The message that the node had read last on each topic: what this tick read before the rest.
    reads: Reads,
    /// When the data behind these began; `None` while that is not known.
    beginnings: Option<Beginnings>,
}

impl TracedTick {
    /// Returns the run time of its end, when it publishes and acts; [`Time::MAX`] if the run ended
    /// before.
    fn ends(&self) -> Time {
        self.tick.ends.unwrap_or(Time::MAX)
    }

    /// Returns the message that the node had read last on each topic, by this tick or before.
    pub fn reads(&self) -> impl Iterator<Item = MessageId> {
        self.reads.iter().copied()
    }

    /// Returns the message that it read from the topic with this index.
    fn read_of(&self, topic: usize) -> Option<MessageId> {
        self.reads().find(|read| read.topic == topic)
    }
}

impl Lineage {
    /// Creates an empty lineage for a graph of this `topology`, whose run begins with the knobs
    /// of `setup`.
    pub fn new<'k>(topology: Topology, setup: impl IntoIterator<Item = &'k Knob>) -> Self {
        let topics = topology.topics.iter().map(|topic| TracedTopic {
            sent: VecDeque::new(),
            depths: vec![(Time::ZERO, topic.depth)],
        });
        let nodes = topology.nodes.iter().enumerate().map(|(index, node)| {
            let mut topics = topology.topics.iter();
            TracedNode {
                executor: node.executor.as_ref().and_then(|name| name.parse().ok()),
                begins: topics.all(|topic| !topic.readers.contains(&index)),
                ..TracedNode::default()
            }
        });
        let mut lineage = Self {
            topics: topics.collect(),
            nodes: nodes.collect(),
            topology,
            way: DataWay::FromSource(None),
            beside: false,
            kept: usize::MAX,
        };
        for knob in setup {
            lineage.knob(Time::ZERO, knob);
        }
        lineage
    }

    /// Returns the same lineage with at most this number of the newest messages and ticks kept per
    /// topic and node: all of the last minute, and at least an eighth of the number.
    #[must_use]
    pub fn keeping(self, kept: usize) -> Self {
        Self { kept, ..self }
    }

    /// Returns the same lineage with the names of the topics on the way of the data to the node that
    /// acts, the sensor's first. Without any, data count by the node that began them.
    #[must_use]
    pub fn along(mut self, path: &[impl AsRef<str>]) -> Self {
        self.set_path(path);
        self
    }

    /// Goes along these topics; `false` if the graph lacks one of them.
    fn set_path(&mut self, path: &[impl AsRef<str>]) -> bool {
        let places = path.iter().map(|name| self.topology.topic(name.as_ref()));
        let places = places.collect::<Option<Vec<usize>>>();
        let is_known = places.is_some();
        self.way = match places {
            Some(path) if !path.is_empty() => DataWay::Along(path),
            _ => DataWay::FromSource(None),
        };
        is_known
    }

    /// Goes another way from now on: along the topics of this `path`, the sensor's first, whatever
    /// pushes its last node measures; by the node that began the data if it is empty. Returns
    /// `false` if the graph lacks one of them.
    pub fn go_along(&mut self, path: &[impl AsRef<str>]) -> bool {
        self.beside = !path.is_empty();
        let is_known = self.set_path(path);
        // What came while it went along a path has no beginnings yet.
        self.settle();
        is_known
    }

    /// Goes by the data of this `source` from now on, whatever else is behind a push.
    pub fn go_from(&mut self, source: usize) {
        self.beside = true;
        self.way = DataWay::FromSource(Some(source));
        self.settle();
    }

    /// Returns the nodes that read nothing, and so begin data.
    pub fn sources(&self) -> impl Iterator<Item = usize> {
        self.nodes
            .iter()
            .enumerate()
            .filter_map(|(index, node)| node.begins.then_some(index))
    }

    /// Returns whether any action of the node with index `node` is known.
    pub fn acts_on_the_world(&self, node: usize) -> bool {
        self.nodes[node].acts
    }

    /// Returns the graph.
    pub fn topology(&self) -> &Topology {
        &self.topology
    }

    /// Adds a message or a tick.
    pub fn add(&mut self, row: RunRow) {
        match row {
            RunRow::Message(topic, head, _) => self.message(topic, &head),
            RunRow::Tick(node, tick) => self.tick(node, tick),
        }
    }

    /// Adds a message published to the topic with index `topic`.
    pub fn message(&mut self, topic: usize, head: &Head) {
        if let Some(topic) = self.topics.get_mut(topic) {
            let is_old = |oldest: &Head| is_long_before(oldest.at, head.at);
            if is_over(&topic.sent, self.kept, is_old) {
                topic.sent.pop_front();
            }
            topic.sent.push_back(*head);
        }
    }

    /// Adds a tick of the node with this `index`.
    pub fn tick(&mut self, index: usize, tick: TickRecord) {
        let Some(node) = self.nodes.get_mut(index) else {
            return;
        };
        let mut reads = Reads::new();
        tick.causes
            .reads
            .iter()
            .rev()
            .for_each(|read| add_read(&mut reads, read.message));
        reads.reverse();
        node.ticks
            .back()
            .into_iter()
            .flat_map(TracedTick::reads)
            .for_each(|read| add_read(&mut reads, read));
        node.acts |= tick.push.is_some();
        let is_old = |oldest: &TracedTick| is_long_before(oldest.tick.at, tick.at);
        if is_over(&node.ticks, self.kept, is_old) {
            node.ticks.pop_front();
            node.settled = node.settled.saturating_sub(1);
        }
        node.ticks.push_back(TracedTick {
            tick,
            reads,
            beginnings: None,
        });
        self.settle_newest(index);
    }

    /// Adds an event: a knob may change a queue depth.
    pub fn event(&mut self, event: &Event) {
        if let Some(TimedKnob { at, knob }) = event.knob() {
            self.knob(at, &knob);
        }
    }

    fn knob(&mut self, at: Time, knob: &Knob) {
        if let Knob::Depth { topic, depth } = knob
            && let Some(topic) = self.topology.topic(topic)
        {
            self.topics[topic].depths.push((at, *depth));
        }
    }

    /// Returns the ticks of the node with index `node`, oldest first.
    pub fn ticks(&self, node: usize) -> impl DoubleEndedIterator<Item = &TracedTick> {
        self.nodes[node].ticks.iter()
    }

    /// Returns the ticks of a node that were running within a stretch of run time, and the one before
    /// them, each with its index.
    pub fn ticks_within(
        &self,
        node: usize,
        span: TimeSpan,
    ) -> impl Iterator<Item = (usize, &TracedTick)> {
        let ticks = &self.nodes[node].ticks;
        let first = ticks.partition_point(|worked| worked.ends() < span.from);
        let last = ticks.partition_point(|worked| worked.tick.at <= span.to);
        let first = first.saturating_sub(1).min(last);
        (first..last).zip(ticks.range(first..last))
    }

    /// Returns the messages of the topic with index `topic`, oldest first.
    pub fn sent(&self, topic: usize) -> impl DoubleEndedIterator<Item = &Head> {
        self.topics[topic].sent.iter()
    }
}

//! The rows of a node and of a topic.

use std::iter;

use ratelab::{Head, MessageId};
use ratelab_metrics::{TickPlace, TickRecord, TracedTick, nanos, sensing_of};

use super::{RunTables, between, milliseconds, owned, seconds};

/// The columns of every node, before the columns of what it reads.
const NODE_COLUMNS: [&str; 7] = [
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
        owned(&NODE_COLUMNS)
            .into_iter()
            .chain(reads)
            .chain(owned(acts))
            .collect()
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
        self.recording.ticks[node]
            .iter()
            .any(|tick| tick.push.is_some())
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
fn timing(tick: &TickRecord) -> [String; NODE_COLUMNS.len()] {
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

/// The columns of every topic, before the numbers of its messages.
const TOPIC_COLUMNS: [&str; 9] = [
    "seq",
    "time_s",
    "stamp_s",
    "sensed_s",
    "age_ms",
    "arrives_s",
    "dropped",
    "made_by",
    "made_by_tick",
];

/// Units of numbers that have another one in the tables: the end of a name, how it ends there, and by
/// what the number is divided.
const UNITS: [(&str, &str, f64); 3] = [
    ("origin (ns)", "origin (s)", 1e9),
    ("at (ms)", "at (s)", 1e3),
    ("(ns)", "(ms)", 1e6),
];

/// Returns the name of a number in the tables, and by what it is divided.
fn converted(name: &str) -> (String, f64) {
    let known = UNITS.into_iter().find_map(|(end, other, divisor)| {
        let of = name.strip_suffix(end)?;
        let whole_words = of.is_empty() || of.ends_with(' ');
        whole_words.then(|| (format!("{of}{other}"), divisor))
    });
    known.unwrap_or_else(|| (name.to_owned(), 1.0))
}

impl RunTables {
    /// Returns the columns of the topic with this index.
    pub(super) fn topic_columns(&self, topic: usize) -> Vec<String> {
        let (rows, fields) = (&self.recording.topics[topic], &self.recording.fields[topic]);
        let width = if rows.is_empty() {
            fields.len()
        } else {
            rows.width()
        };
        // A file may lack names.
        let numbered = (fields.len() + 1..).map(|number| format!("number {number}"));
        owned(&TOPIC_COLUMNS)
            .into_iter()
            .chain(
                fields
                    .iter()
                    .cloned()
                    .chain(numbered)
                    .take(width)
                    .map(|name| converted(&name).0),
            )
            .collect()
    }

    /// Returns the messages of a topic.
    pub(super) fn messages(&self, topic: usize) -> Vec<Vec<String>> {
        let rows = self.recording.topics[topic].iter();
        let divisors: Vec<f64> = self.recording.fields[topic]
            .iter()
            .map(|name| converted(name).1)
            .collect();
        let all_divisors = divisors.iter().copied().chain(iter::repeat(1.0));
        rows.map(|(head, numbers)| {
            self.head(topic, head)
                .into_iter()
                .chain(
                    numbers
                        .iter()
                        .zip(all_divisors.clone())
                        .map(|(number, divisor)| {
                            if number.is_nan() {
                                String::new()
                            } else {
                                (number / divisor).to_string()
                            }
                        }),
                )
                .collect()
        })
        .collect()
    }

    /// Returns a message of a topic without its numbers.
    fn head(&self, topic: usize, head: &Head) -> [String; TOPIC_COLUMNS.len()] {
        let sensed = sensing_of(head);
        let seq = head.seq;
        let made =
            self.lineage
                .made_by(MessageId { topic, seq })
                .map(|TickPlace { node, index }| {
                    let tick = self.recording.ticks[node]
                        .get(index)
                        .map(|tick| tick.number.to_string());
                    let name = &self.recording.origin.topology.nodes[node].name;
                    (name.clone(), tick.unwrap_or_default())
                });
        let (node, tick) = made.unwrap_or_default();
        [
            head.seq.to_string(),
            seconds(head.at),
            seconds(head.stamp),
            seconds(sensed),
            between(sensed, head.at),
            head.arrives.map(seconds).unwrap_or_default(),
            head.dropped.to_string(),
            node,
            tick,
        ]
    }
}

//! A recorded run as tables: of its topics, its nodes, its ages and its events.
//!
//! Times are run times in seconds, durations and ages are in milliseconds, and each name of a
//! column has its unit. A cell is empty where there is nothing, such as the arrival of a lost
//! message.

use std::{iter, sync::Arc};

use ratelab::{Head, MessageId, Time};
use ratelab_experiment::RunAge;
use ratelab_metrics::{Lineage, TickPlace, TickRecord, TracedTick, nanos};
use ratelab_recording::{Recording, Replay, printable::row_of};
use ratelab_system::{System, names::key};

use crate::summary::ages::data_of;

/// What a table is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableSubject {
    /// The topic with this index.
    Topic(usize),
    /// The node with this index.
    Node(usize),
    /// The ages of the run and their parts.
    Ages,
    /// What happened to the run.
    Events,
}

/// A recorded run with all that its tables are made of.
pub struct RunTables {
    recording: Arc<Recording>,
    lineage: Lineage,
    ages: Vec<RunAge>,
}

impl RunTables {
    /// Creates the tables of `recording`, a run of this `system` or of another one.
    pub fn new(recording: &Arc<Recording>, system: &Arc<dyn System>) -> Self {
        let mut replay = Replay::new(recording.clone(), system);
        replay.advance_to(Time::MAX);
        let system = replay.system();
        let lineage = recording.lineage();
        Self {
            ages: recording.ages(&**system, &replay.summary()),
            lineage: lineage.along(system.about().latency_path()),
            recording: recording.clone(),
        }
    }

    /// Returns the tables that there are: of all nodes, and of the topics whose messages were
    /// recorded.
    pub fn subjects(&self) -> Vec<TableSubject> {
        let Recording { run, fields, .. } = &*self.recording;
        let topics = fields
            .iter()
            .zip(&run.topics)
            .enumerate()
            .filter(|(_, (fields, rows))| !fields.is_empty() || !rows.is_empty())
            .map(|(topic, _)| TableSubject::Topic(topic));
        let nodes = (0..run.ticks.len()).map(TableSubject::Node);
        topics
            .chain(nodes)
            .chain([TableSubject::Ages, TableSubject::Events])
            .collect()
    }

    /// Returns the name of a table.
    pub fn name(&self, subject: TableSubject) -> String {
        let topology = &self.recording.origin.topology;
        match subject {
            TableSubject::Topic(topic) => format!("topic {}", topology.topics[topic].name),
            TableSubject::Node(node) => format!("node {}", topology.nodes[node].name),
            TableSubject::Ages => "ages".to_owned(),
            TableSubject::Events => "events".to_owned(),
        }
    }

    /// Returns the first line of a table: the names of its columns.
    pub fn header(&self, subject: TableSubject) -> String {
        row_of(self.columns(subject))
    }

    /// Returns the names of the columns of a table.
    pub fn columns(&self, subject: TableSubject) -> Vec<String> {
        let names = match subject {
            TableSubject::Topic(topic) => self.topic_columns(topic),
            TableSubject::Node(node) => self.node_columns(node),
            TableSubject::Ages => owned(&["of", "at", "part", "due_to", "mean_ms"]),
            TableSubject::Events => owned(&["time_s", "event"]),
        };
        apart(names)
    }

    /// Returns a table as text.
    pub fn text(&self, subject: TableSubject) -> String {
        let rows = self.rows(subject).into_iter().map(row_of);
        [self.header(subject)]
            .into_iter()
            .chain(rows)
            .fold(String::new(), |text, line| text + &line + "\n")
    }

    /// Returns the cells of a table, row by row.
    pub fn rows(&self, subject: TableSubject) -> Vec<Vec<String>> {
        match subject {
            TableSubject::Topic(topic) => self.messages(topic),
            TableSubject::Node(node) => self.ticks(node),
            TableSubject::Ages => self.ages.iter().flat_map(age_rows).collect(),
            TableSubject::Events => {
                let events = self.recording.events.iter().map(|event| {
                    let text = event.to_string();
                    vec![
                        seconds(event.at),
                        text.strip_prefix(&format!("{}: ", event.at))
                            .unwrap_or(&text)
                            .to_owned(),
                    ]
                });
                events.collect()
            }
        }
    }
}

/// Returns an age, then each of its parts.
fn age_rows(age: &RunAge) -> Vec<Vec<String>> {
    let row = |part: &str, owner: &str, ns: i64| {
        // The push itself keeps its name.
        let data = Some(age).filter(|age| age.is_beside).map(data_of);
        let of = age.name().to_owned() + &data.unwrap_or_default();
        let words = [&*of, &age.node, part, owner].map(str::to_owned);
        words.into_iter().chain([milliseconds(ns)]).collect()
    };
    let parts = age
        .parts
        .iter()
        .map(|part| row(part.stage.key(), &part.owner, part.ns));
    [row("all", "", age.mean_ns)]
        .into_iter()
        .chain(parts)
        .collect()
}

fn owned(names: &[&str]) -> Vec<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

/// Makes the names of columns distinct.
fn apart(names: Vec<String>) -> Vec<String> {
    let mut known: Vec<String> = Vec::new();
    for name in names {
        let name = key(&name);
        let others = (2..).map(|number| format!("{name}_{number}"));
        let free = [name.clone()]
            .into_iter()
            .chain(others)
            .find(|name| !known.contains(name));
        known.extend(free);
    }
    known
}

/// Returns a run time in seconds.
fn seconds(at: Time) -> String {
    at.as_secs_f64().to_string()
}

/// Returns a duration in milliseconds.
fn milliseconds(ns: i64) -> String {
    (ns as f64 / 1e6).to_string()
}

/// Returns how long `later` is after `earlier` (ms): less than zero after an error of a clock.
fn between(earlier: Time, later: Time) -> String {
    let ns = i128::from(later.as_nanos()) - i128::from(earlier.as_nanos());
    milliseconds(i64::try_from(ns).unwrap_or(i64::MAX))
}

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
    fn node_columns(&self, node: usize) -> Vec<String> {
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
    fn ticks(&self, node: usize) -> Vec<Vec<String>> {
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
                let sensed = head.sensed();
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
    fn topic_columns(&self, topic: usize) -> Vec<String> {
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
    fn messages(&self, topic: usize) -> Vec<Vec<String>> {
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
        let sensed = head.sensed();
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

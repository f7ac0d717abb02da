//! A recorded run as tables: of its topics, its nodes, its ages and its events.
//!
//! Times are run times in seconds, durations and ages are in milliseconds, and each name of a column
//! has its unit. A cell is empty where there is nothing, such as the arrival of a lost message.

mod rows;
use std::sync::Arc;

use ratelab::Time;
use ratelab_experiment::RunAge;
use ratelab_metrics::Lineage;
use ratelab_recording::{Recording, Replay};
use ratelab_system::{System, names::key};

use crate::summary::ages::data_of;
use ratelab_recording::printable::row_of;

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

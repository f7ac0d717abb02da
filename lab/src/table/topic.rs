//! The table of a topic: a row for each message.

use std::iter;

use ratelab::{Head, MessageId};
use ratelab_metrics::sensing_of;

use super::{RunTables, between, owned, seconds};

/// The columns of every topic, before the numbers of its messages.
const COLUMNS: [&str; 9] = [
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
    let mut units = UNITS.into_iter();
    let known = units.find_map(|(end, other, divisor)| {
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
        owned(&COLUMNS)
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
        let names = self.recording.fields[topic].iter();
        let divisors: Vec<f64> = names.map(|name| converted(name).1).collect();
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
    fn head(&self, topic: usize, head: &Head) -> [String; COLUMNS.len()] {
        let sensed = sensing_of(head);
        let seq = head.seq;
        let made = self
            .lineage
            .made_by(MessageId { topic, seq })
            .map(|(node, index)| {
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

//! A digest of all that readers read of a recording: a value that was altered is found, even
//! where nothing comes of it when the run is executed again.

use std::time::Duration;

use ratelab::{Head, Time, Topology};
use ratelab_account::{Rows, TickRecord};
use xxhash_rust::xxh3::Xxh3;

use super::schema::RecordingEnd;

/// The digest of a recording so far: the same for its writer and its reader.
#[derive(Default)]
pub struct ContentDigest {
    origin: Xxh3,
    topics: Vec<Xxh3>,
    nodes: Vec<Xxh3>,
    events: Xxh3,
}

impl ContentDigest {
    /// Begins with the description of the run, as JSON, and its graph.
    pub fn new(origin: &str, topology: &Topology) -> Self {
        let mut digest = Self {
            topics: vec![Xxh3::new(); topology.topics.len()],
            nodes: vec![Xxh3::new(); topology.nodes.len()],
            ..Self::default()
        };
        digest.origin.update(origin.as_bytes());
        digest
    }

    /// Adds messages of topic number `topic`.
    pub fn add_messages(&mut self, topic: usize, rows: &Rows) {
        for (head, values) in rows.iter() {
            self.add_message(topic, head, values);
        }
    }

    /// Adds a message of topic number `topic`.
    pub fn add_message(&mut self, topic: usize, head: &Head, values: &[f64]) {
        let digest = &mut self.topics[topic];
        let numbers = [
            head.seq,
            head.at.as_nanos(),
            head.stamp.as_nanos(),
            head.dropped,
        ];
        update(digest, numbers);
        update(digest, option(head.origin.map(Time::as_nanos)));
        update(digest, option(head.arrives.map(Time::as_nanos)));
        values
            .iter()
            .for_each(|value| update(digest, [value.to_bits()]));
    }

    /// Adds a tick of node number `node`.
    pub fn add_tick(&mut self, node: usize, tick: &TickRecord) {
        let digest = &mut self.nodes[node];
        let nanos = |duration: Option<Duration>| option(duration.map(|d| d.as_nanos() as u64));
        update(digest, [tick.number, tick.at.as_nanos(), tick.overruns]);
        update(digest, nanos(tick.lateness));
        update(digest, nanos(tick.took));
        update(digest, option(tick.push.map(|push| push.at.as_nanos())));
        update(digest, option(tick.push.map(|push| push.sensed.as_nanos())));
    }

    /// Adds an event, as JSON.
    pub fn add_event(&mut self, json: &str) {
        self.events.update(json.as_bytes());
        self.events.update(b"\n");
    }

    /// The digest of a recording with this `end`.
    pub fn with_end(&self, end: &RecordingEnd) -> u64 {
        let end = RecordingEnd {
            digest: None,
            ..end.clone()
        };
        let series = self.topics.iter().chain(&self.nodes);
        let parts = [&self.origin, &self.events].into_iter().chain(series);
        let mut whole = Xxh3::new();
        parts.for_each(|part| update(&mut whole, [part.digest()]));
        whole.update(serde_json::to_string(&end).unwrap_or_default().as_bytes());
        whole.digest()
    }
}

fn update<const N: usize>(digest: &mut Xxh3, numbers: [u64; N]) {
    digest.update(numbers.map(u64::to_le_bytes).as_flattened());
}

fn option(number: Option<u64>) -> [u64; 2] {
    [number.is_some().into(), number.unwrap_or(0)]
}

//! A difference and its place; graph and end compared.

use ratelab::{NodeTopology, Time, TopicTopology, Topology};
use thiserror::Error;

use crate::run::{RecordingEnd, RunResult, RunStatus};

/// The first thing that is not the same.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("differs at {at}: {what}: recorded {recorded}, computed {computed}")]
pub struct Difference {
    /// Run time of it.
    pub at: Time,
    /// The item.
    pub what: String,
    /// The recorded value.
    pub recorded: String,
    /// The value of the new run.
    pub computed: String,
}

impl Difference {
    /// Of what was `recorded` and is `computed`, at run time `at`.
    pub fn new(at: Time, what: impl Into<String>, [recorded, computed]: [String; 2]) -> Self {
        Self {
            at,
            what: what.into(),
            recorded,
            computed,
        }
    }

    /// Returns the first of `parts` that is not as it was recorded.
    pub fn first(parts: impl IntoIterator<Item = Self>) -> Option<Self> {
        parts
            .into_iter()
            .find(|part| part.recorded != part.computed)
    }
}

/// Returns a run time to the nanosecond.
pub fn nanos(time: Time) -> String {
    format!("{} ns", time.as_nanos())
}

/// Returns a number to the bit.
pub fn bits(value: f64) -> String {
    format!("{value:?} ({:#018x})", value.to_bits())
}

/// Returns the first node or topic that is another one.
pub fn compare_topology(recorded: &Topology, computed: &Topology) -> Option<Difference> {
    let nodes = [recorded, computed].map(|graph| graph.nodes.iter().map(node).collect());
    let topics = [recorded, computed].map(|graph| graph.topics.iter().map(topic).collect());
    let parts = pairs("node", nodes).chain(pairs("topic", topics));
    Difference::first(parts)
}

/// Returns what is recorded and what is computed, one after the other.
fn pairs(kind: &str, runs: [Vec<String>; 2]) -> impl Iterator<Item = Difference> {
    (0..runs[0].len().max(runs[1].len())).map(move |index| {
        let told = |items: &Vec<String>| items.get(index).map_or("none".to_owned(), String::clone);
        let what = format!("{kind} {index} of the graph");
        Difference::new(Time::ZERO, what, runs.each_ref().map(told))
    })
}

fn node(node: &NodeTopology) -> String {
    let NodeTopology {
        name,
        priority,
        hz,
        triggers,
        executor,
        // Recordings of before have none of these.
        matching: _,
        executor_index: _,
        group: _,
        meters,
    } = node;
    let named = executor.as_ref();
    let executor = named.map_or(String::new(), |executor| format!(", executor {executor}"));
    let release = if triggers.is_empty() {
        format!("at {hz}")
    } else {
        format!("triggered by topics {triggers:?}")
    };
    format!("{name} {release}{executor}, priority {priority}, meters {meters:?}")
}

fn topic(topic: &TopicTopology) -> String {
    let TopicTopology {
        name,
        depth,
        publishers,
        readers,
    } = topic;
    format!("{name} depth {depth}, published by nodes {publishers:?}, read by {readers:?}")
}

/// A part of an end in words.
type ToldPart = fn(&RecordingEnd) -> String;

/// The parts of an end, each to the bit: all of it but the wall's time, and what topics lost.
const PARTS: [(&str, ToldPart); 7] = [
    ("the end of the run", status),
    ("time of the verdict", |end| {
        told(end, |run| nanos(run.verdict.at))
    }),
    ("run time at the end", |end| {
        told(end, |run| nanos(run.sim_time))
    }),
    ("figures of the last state", |end| told(end, finals)),
    ("run time at the end", |end| nanos(end.at)),
    ("the clock at the end", |end| end.clock.to_string()),
    ("what came too fast", |end| end.lost.to_string()),
];

/// Returns the first part of the end of a run of the graph `topology` that is not the same.
pub fn compare_end(ends: [&RecordingEnd; 2], topology: &Topology) -> Option<Difference> {
    let at = ends[0].at;
    let parts = PARTS.map(|(what, told)| Difference::new(at, what, ends.map(told)));
    let losses = |lost: &'static str, of: fn(&RecordingEnd) -> &Option<Vec<u64>>| {
        let [recorded, computed] = ends.map(|end| of(end).iter().flatten());
        topology.topics.iter().zip(recorded.zip(computed)).map(
            move |(topic, (recorded, computed))| {
                let what = format!("messages of {} {lost} in all", topic.name);
                Difference::new(at, what, [recorded, computed].map(u64::to_string))
            },
        )
    };
    let dropped = losses("dropped", |end| &end.dropped);
    let unmatched = losses("unmatched", |end| &end.unmatched);
    Difference::first(parts.into_iter().chain(dropped).chain(unmatched))
}

fn told(end: &RecordingEnd, part: fn(&RunResult) -> String) -> String {
    end.result().map_or("none".to_owned(), part)
}

fn status(end: &RecordingEnd) -> String {
    match &end.end {
        RunStatus::Failed { fault } => fault.clone(),
        _ => told(end, |run| {
            format!("{} after {} steps", run.verdict.name, run.steps)
        }),
    }
}

fn finals(run: &RunResult) -> String {
    let finals = run.finals.iter().map(|(name, value)| {
        let value_text = value.map_or("none".to_owned(), bits);
        format!("{name} {value_text}")
    });
    finals.collect::<Vec<_>>().join(", ")
}

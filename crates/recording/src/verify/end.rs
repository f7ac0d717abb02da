//! How a run ended when it was recorded, held against how it ends now.

use ratelab::Topology;

use super::difference::{Difference, bits, nanos};
use crate::run::{RecordingEnd, RunResult, RunStatus};

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
pub fn compare(ends: [&RecordingEnd; 2], topology: &Topology) -> Option<Difference> {
    let at = ends[0].at;
    let parts = PARTS.map(|(what, told)| Difference::new(at, what, ends.map(told)));
    let losses = |lost: &'static str, of: fn(&RecordingEnd) -> &Option<Vec<u64>>| {
        let [recorded, computed] = ends.map(|end| of(end).iter().flatten());
        let topics = topology.topics.iter().zip(recorded.zip(computed));
        topics.map(move |(topic, (recorded, computed))| {
            let what = format!("messages of {} {lost} in all", topic.name);
            Difference::new(at, what, [recorded, computed].map(u64::to_string))
        })
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

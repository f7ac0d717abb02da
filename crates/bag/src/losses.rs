//! Messages that the recorder lost, by what others made of them.

use std::collections::BTreeMap;

use crate::{
    bag::NO_STAMP,
    node::{BagNode, Kind},
    numbers::{median, nearest},
    stamps::TopicEvents,
};

/// The messages to put back: for each topic the time of each stamp (ns).
type Missing = BTreeMap<usize, BTreeMap<i64, i64>>;

/// Puts the messages back that the recorder lost, and counts them in `filled`. Returns the topics.
pub fn put_back(series: &mut [TopicEvents], nodes: &[BagNode], filled: &mut [usize]) -> Vec<usize> {
    let mut missing = Missing::new();
    for node in nodes {
        find(series, nodes, node, &mut missing);
    }
    missing.retain(|topic, stamps| stamps.len() * 10 < series[*topic].events.len() * 3);
    for (topic, stamps) in &missing {
        filled[*topic] += stamps.len();
        let series = &mut series[*topic];
        let found = series
            .events
            .iter()
            .copied()
            .zip(series.stamps.iter().copied());
        let put = stamps.iter().map(|(stamp, event)| (*event, *stamp));
        let mut all: Vec<(i64, i64)> = found.chain(put).collect();
        all.sort_by_key(|(event, _)| *event);
        (series.events, series.stamps) = all.into_iter().unzip();
        series.sort();
    }
    missing.into_keys().collect()
}

/// Finds the stamps of a node's outputs that are missing in its input.
fn find(series: &[TopicEvents], nodes: &[BagNode], node: &BagNode, missing: &mut Missing) {
    let Some(input) = &node.input else { return };
    let b = &series[node.topic];
    let is_root = |topic: usize| {
        nodes
            .iter()
            .filter(|node| node.topic == topic)
            .any(|node| node.kind == Kind::Sensor)
    };
    for topic in std::iter::once(input.parent).chain(input.other) {
        let a = &series[topic];
        let Some((least, greatest)) = a.range() else {
            continue;
        };
        let usual = if is_root(topic) {
            let stamped = a
                .events
                .iter()
                .zip(&a.stamps)
                .filter(|(_, stamp)| **stamp != NO_STAMP);
            median(
                stamped
                    .map(|(event, stamp)| event.saturating_sub(*stamp))
                    .collect(),
            )
        } else {
            let delays = input.triggered.steps.iter().filter_map(|step| {
                let input = a.events.get(step.input?)?;
                Some(b.events[step.output] - input)
            });
            median(delays.collect())
        };
        let usual = nearest(usual);
        for (stamp, place) in b.firsts() {
            if stamp < least || stamp > greatest || !a.with_stamp(stamp).is_empty() {
                continue;
            }
            let end = b.events[place];
            let event = if is_root(topic) {
                stamp.saturating_add(usual)
            } else {
                end.saturating_sub(usual)
            };
            let event = event.min(end - 1);
            let known = missing
                .entry(topic)
                .or_default()
                .entry(stamp)
                .or_insert(event);
            *known = event.min(*known);
        }
    }
}

//! Quantiles and histograms of a running graph, read at intervals.
//!
//! Distributions cost more to read than everything else in a frame, and figures that
//! change thirty times a second are unreadable.

use std::time::{Duration, Instant};

use ratelab_metrics::{Distribution, Snapshot, TopicAccount};
use ratelab_recording::{BINS, width_ms};
use ratelab_system::System;

use super::{
    frame::{LatencyData, Quantiles},
    knobs::first_node,
};

/// Interval between two reads while the graph runs (wall time).
const PERIOD: Duration = Duration::from_millis(150);

/// The figures as of the last read.
#[derive(Default)]
pub struct Figures {
    /// Per node: lateness and duration of its ticks.
    pub nodes: Vec<[Quantiles; 2]>,
    /// Data age at each read, per topic.
    pub ages: Vec<Quantiles>,
    /// The latency of the system, if measured.
    pub latency: Option<LatencyData>,
    /// Total number of ticks at the last read, and whether the graph was at rest: while
    /// these stay the same, so do the figures.
    state: Option<(u64, bool)>,
    read: Option<Instant>,
}

impl Figures {
    /// Reads the figures again after the interval, or when the graph has come to rest.
    pub fn refresh(&mut self, system: &dyn System, graph: &Snapshot, at_rest: bool) {
        let ticks = graph
            .nodes
            .iter()
            .map(|node| node.ticks)
            .fold(0, u64::saturating_add);
        let state = Some((ticks, at_rest));
        let waited = self.read.is_none_or(|read| read.elapsed() >= PERIOD);
        if state == self.state || !(waited || at_rest) {
            return;
        }
        let nodes = graph
            .nodes
            .iter()
            .map(|node| [&node.lateness, &node.tick_time].map(Quantiles::from_distribution));
        *self = Self {
            nodes: nodes.collect(),
            ages: graph.topics.iter().map(worst_age).collect(),
            latency: latency(system, graph),
            state,
            read: Some(Instant::now()),
        };
    }
}

/// Data age of the topic's slowest reader.
fn worst_age(topic: &TopicAccount) -> Quantiles {
    topic
        .readers
        .iter()
        .map(|s| Quantiles::from_distribution(&s.ages))
        .max_by_key(|age| age.p99)
        .unwrap_or_default()
}

fn latency(system: &dyn System, snapshot: &Snapshot) -> Option<LatencyData> {
    let (node, name) = system.latency()?;
    let distribution = snapshot.meter(node, name)?;
    let figures = Quantiles::from_distribution(distribution);
    let period = first_node(system, snapshot)
        .map(|node| node.hz.period())
        .unwrap_or_default();
    let bin = bin_width(figures.max.max(period));
    Some(LatencyData {
        name: name.to_owned(),
        figures,
        bins: bins(distribution, bin),
        bin,
        newest: None,
        period,
    })
}

/// Returns the narrowest bin width for which all bins but the last reach `longest`.
fn bin_width(longest: Duration) -> Duration {
    let reach = |ms: u64| Duration::from_millis(ms * (BINS as u64 - 1)) >= longest;
    Duration::from_millis(width_ms(reach))
}

/// Counts per bin; longer durations count in the last one.
fn bins(distribution: &Distribution, bin: Duration) -> Vec<u64> {
    let width = bin.as_nanos().max(1) as u64;
    let mut bins = vec![0; BINS];
    for (latency, count) in distribution.bars() {
        let index = (latency.as_nanos() as u64 / width) as usize;
        bins[index.min(BINS - 1)] += count;
    }
    bins
}

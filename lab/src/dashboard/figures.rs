//! Quantiles and histograms of a running graph, read now and then.
//!
//! Distributions cost more to read than all else that a frame holds, and
//! figures that change thirty times a second cannot be read by anybody.

use std::time::{Duration, Instant};

use ratelab::{
    runtime::{
        Observer, Snapshot,
        telemetry::{Distribution, NodeView, TopicView},
    },
    system::System,
};

use super::{
    frame::{LatencyData, Quantiles},
    knob_focus::first_node,
};
use crate::bins::{BINS, width_ms};

/// Wall time between two readings while the graph runs.
const PERIOD: Duration = Duration::from_millis(150);

/// The figures as they were last read.
#[derive(Default)]
pub struct Figures {
    /// Per node.
    pub nodes: Vec<NodeFigures>,
    /// Per topic, how old messages were when they were read.
    pub ages: Vec<Quantiles>,
    /// The latency that matters, if the system has one.
    pub latency: Option<LatencyData>,
    /// Ticks of all nodes when they were read, and whether the graph was at
    /// rest: while neither changes, nor do they.
    state: Option<(u64, bool)>,
    read: Option<Instant>,
}

/// The measurements of a node.
#[derive(Clone, Copy, Default)]
pub struct NodeFigures {
    /// How late its ticks began.
    pub lateness: Quantiles,
    /// How long they took.
    pub tick_time: Quantiles,
}

impl Figures {
    /// Reads them again if it is time to, or if the graph has come to rest.
    pub fn refresh(
        &mut self,
        system: &dyn System,
        observer: &Observer,
        counters: &Snapshot,
        at_rest: bool,
    ) {
        let ticks = counters.nodes.iter().map(|node| node.ticks).sum();
        let state = Some((ticks, at_rest));
        let waited = self.read.is_none_or(|read| read.elapsed() >= PERIOD);
        if state == self.state || !(waited || at_rest) {
            return;
        }
        let snapshot = observer.snapshot();
        *self = Self {
            nodes: snapshot.nodes.iter().map(NodeFigures::of).collect(),
            ages: snapshot.topics.iter().map(worst_age).collect(),
            latency: latency(system, &snapshot),
            state,
            read: Some(Instant::now()),
        };
    }
}

impl NodeFigures {
    fn of(node: &NodeView) -> Self {
        Self {
            lateness: Quantiles::of(&node.lateness),
            tick_time: Quantiles::of(&node.tick_time),
        }
    }
}

/// Of several readers of a topic, the worst is shown.
fn worst_age(topic: &TopicView) -> Quantiles {
    let ages = topic.subscriptions.iter().map(|s| Quantiles::of(&s.ages));
    ages.max_by_key(|age| age.p99).unwrap_or_default()
}

fn latency(system: &dyn System, snapshot: &Snapshot) -> Option<LatencyData> {
    let (node, name) = system.latency()?;
    let distribution = snapshot.meter(node, name)?;
    let figures = Quantiles::of(distribution);
    let period = first_node(system, snapshot).map(|node| node.hz.period());
    let period = period.unwrap_or_default();
    let bin = bin_width(figures.max.max(period));
    Some(LatencyData {
        name,
        figures,
        bins: bins(distribution, bin),
        bin,
        newest: None,
        period,
    })
}

/// The narrowest bin with which all but the last of them reach `longest`.
fn bin_width(longest: Duration) -> Duration {
    let reach = |ms: u64| Duration::from_millis(ms * (BINS as u64 - 1)) >= longest;
    Duration::from_millis(width_ms(reach))
}

/// Counts per bin; what is beyond the last counts there.
fn bins(distribution: &Distribution, bin: Duration) -> Vec<u64> {
    let width = bin.as_nanos().max(1) as u64;
    let mut bins = vec![0; BINS];
    for (latency, count) in distribution.bars() {
        let index = (latency.as_nanos() as u64 / width) as usize;
        bins[index.min(BINS - 1)] += count;
    }
    bins
}

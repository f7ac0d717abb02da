//! What a frame shows of a node, of a topic and of the push in force; and quantiles and histograms
//! of a running graph, read at intervals.
//!
//! Distributions cost more to read than everything else in a frame, and figures that
//! change thirty times a second are unreadable.

use std::time::{Duration, Instant};

use ratelab::{Event, Time};
use ratelab_experiment::cause::Facts;
use ratelab_metrics::{Distribution, NodeAccount, Snapshot, TopicAccount, mean_parts};
use ratelab_recording::{BINS, width_ms};
use ratelab_system::{System, acting_node};

use super::standing::RunMoment;
use crate::{
    age::{PARTS, PushData, PushSentence, UNKNOWN},
    frame::{LatencyData, NodeData, Quantiles, TopicData},
    knobs::{first_node, in_words},
    lineage_taps::dots,
    push_age,
};

impl RunMoment<'_> {
    /// Returns the parts of the age of the push in force.
    pub fn push(&self) -> Option<PushData> {
        let Facts {
            graph,
            lineage,
            late,
            ..
        } = self.facts;
        let acts = acting_node(self.facts.system, lineage.topology())?;
        let parts = lineage.push_at(acts, graph.now)?.parts(graph.now);
        let stages = mean_parts(lineage, acts, late);
        let mut mean = PARTS.map(|[_, word]| {
            Duration::from_nanos(
                stages
                    .iter()
                    .filter(|(stage, _)| stage.word() == word)
                    .map(|(_, ns)| ns)
                    .sum::<f64>() as u64,
            )
        });
        let known: Duration = mean.iter().sum();
        let age = self.facts.age.map_or(Duration::ZERO, |age| age.mean);
        if let Some(place) = PARTS.iter().position(|[_, word]| *word == UNKNOWN) {
            mean[place] += age.saturating_sub(known);
        }
        Some(PushData {
            sentence: PushSentence::new(&parts, lineage.topology()),
            reaction: push_age::greatest(lineage, acts, late),
            mean,
        })
    }

    /// Returns what is shown of a node, `lit` if it ticked recently.
    pub fn node(
        &self,
        node: &NodeAccount,
        [lateness, tick_time]: [Quantiles; 2],
        lit: bool,
    ) -> NodeData {
        NodeData {
            name: node.name.clone(),
            caption: self.facts.system.about().caption(&node.name),
            hz: node.hz,
            triggered: !node.triggers.is_empty(),
            ticks: node.ticks,
            overruns: node.overruns,
            lit,
            health: self.health(node),
            place: self.session.place(&node.name).map(|place| place.text),
            lateness,
            tick_time,
        }
    }
}

/// Returns what is shown of a topic.
pub(super) fn topic_data(topic: &TopicAccount, age: Quantiles, now: Time) -> TopicData {
    TopicData {
        name: topic.name.clone(),
        depth: topic.depth.get(),
        published: topic.published,
        per_second: topic.per_second(now),
        average: topic.average(now),
        dropped: topic.dropped(),
        dropped_lately: topic.dropped_lately(now),
        lost: topic.lost,
        lost_lately: topic.lost_lately(now),
        overtaken: topic.overtaken,
        unmatched: topic.unmatched(),
        dots: dots(&topic.flights, now),
        publishers: topic.publishers.clone(),
        readers: topic.readers.iter().map(|s| s.node).collect(),
        age,
        held: topic.newest.map(|newest| now.since(newest)),
    }
}

/// Returns the marks of the knobs in `events` from run time `begin` (s) on.
pub(super) fn marks(system: &dyn System, events: &[Event], begin: f64) -> Vec<(f64, String)> {
    let knobs: Vec<_> = events
        .iter()
        .filter(|event| event.at.as_secs_f64() >= begin)
        .filter_map(Event::knob)
        .collect();
    let marks = in_words(system, &knobs).into_iter();
    marks.map(|(at, text)| (at.as_secs_f64(), text)).collect()
}

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

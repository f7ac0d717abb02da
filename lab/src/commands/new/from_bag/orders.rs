//! What no bag shows is tried: the order in which nodes of one thread register, and which of two readings
//! is right.

use std::{sync::Arc, time::Duration};

use ratelab::{ClockKind, Time, millis};
use ratelab_bag::{Analysis, BagNode, Kind};
use ratelab_experiment::{Config, Experiment};
use ratelab_system::{System, graph_file::GraphFile, measured::loaded};

use super::{GraphOfBag, sheet::ValueTable};

/// The most nodes of a thread whose orders are run.
const MOST: usize = 4;

/// The difference of ages from which on another reading is tried.
const FAR: f64 = 0.02;

/// A kind that is less sure may be another one.
const DOUBTFUL: f64 = 0.75;

/// The nodes of a thread as they register, by topic.
#[derive(Clone)]
pub struct ThreadOrder {
    /// The kind of executor.
    pub kind: &'static str,
    /// The topics of its nodes.
    pub topics: Vec<usize>,
}

/// Of the graphs that `graph` writes the one whose ages are nearest to those of the bag: by the orders
/// on shared threads, and by both readings of nodes that may be timers or triggered.
pub fn nearest(
    analysis: &mut Analysis,
    graph: impl Fn(&Analysis, &[ThreadOrder]) -> GraphOfBag,
) -> GraphOfBag {
    let mut orders: Vec<ThreadOrder> = analysis
        .shared
        .iter()
        .map(|topics| usual(analysis, topics))
        .collect();
    let mut best = graph(analysis, &orders);
    let mut least = distance(&best).unwrap_or(f64::INFINITY);
    for thread in 0..orders.len() {
        for order in others(&orders[thread]) {
            let known = std::mem::replace(&mut orders[thread], order);
            let found = graph(analysis, &orders);
            let far = distance(&found).unwrap_or(f64::INFINITY);
            if far < least {
                (best, least) = (found, far);
            } else {
                orders[thread] = known;
            }
        }
    }
    for place in 0..analysis.nodes.len() {
        let other = other_kind(&analysis.nodes[place]).filter(|_| least > FAR);
        let Some(other) = other else { continue };
        let known = std::mem::replace(&mut analysis.nodes[place].kind, other);
        let found = graph(analysis, &orders);
        let far = distance(&found).unwrap_or(f64::INFINITY);
        if far < least / 2.0 {
            (best, least) = (found, far);
        } else {
            analysis.nodes[place].kind = known;
        }
    }
    best
}

/// Returns what a node may be as well.
fn other_kind(node: &BagNode) -> Option<Kind> {
    node.input.as_ref()?.timed?;
    match node.kind {
        Kind::Timer if node.confidence < DOUBTFUL => Some(Kind::Trigger),
        Kind::Trigger if node.confidence < DOUBTFUL => Some(Kind::Timer),
        _ => None,
    }
}

/// Timers first, as rclcpp looks for them.
fn usual(analysis: &Analysis, topics: &[usize]) -> ThreadOrder {
    let is_timer = |topic: &usize| {
        let node = analysis.node(*topic);
        node.is_some_and(|node| node.kind == Kind::Timer)
    };
    let (timers, others): (Vec<usize>, Vec<usize>) = topics.iter().partition(|of| is_timer(of));
    ThreadOrder {
        kind: "single",
        topics: [timers, others].concat(),
    }
}

/// Returns all other orders, and an executor that follows the order of events.
fn others(first: &ThreadOrder) -> Vec<ThreadOrder> {
    if first.topics.len() > MOST {
        return Vec::new();
    }
    let single = |topics| ThreadOrder {
        kind: "single",
        topics,
    };
    let events = ThreadOrder {
        kind: "events",
        topics: first.topics.clone(),
    };
    permutations(&first.topics)
        .into_iter()
        .skip(1)
        .map(single)
        .chain([events])
        .collect()
}

fn permutations(of: &[usize]) -> Vec<Vec<usize>> {
    if of.is_empty() {
        return vec![Vec::new()];
    }
    let all = of.iter().enumerate().flat_map(|(place, first)| {
        let rest = [&of[..place], &of[place + 1..]].concat();
        permutations(&rest)
            .into_iter()
            .map(|rest| [vec![*first], rest].concat())
    });
    all.collect()
}

/// Returns how far the mean ages of the graph are from those of the bag, in all; `None` if it does
/// not run.
fn distance(graph: &GraphOfBag) -> Option<f64> {
    let column = |file: &str| {
        let name = file.rsplit('/').next().unwrap_or(file);
        let table = graph.tables.iter().find(|table| table.file == name);
        table.map(durations)
    };
    let file = GraphFile::parse(&graph.text).ok()?;
    let file = file.map_settings(|knob| {
        loaded(knob, |_, measured| {
            column(measured.file()).ok_or_else(|| "no such table".to_owned())
        })
    });
    let system = Arc::new(file.ok()?.system(&[]).ok()?);
    let config = Config {
        clock: ClockKind::Virtual,
        end: Time::from_secs_f64(graph.seconds).ok()?,
        knobs: system.about().events.to_vec(),
        ..Config::default()
    };
    let summary = Experiment::new(system.clone(), &config).ok()?.run().ok()?;
    let far = system.about().chains.iter().filter_map(|chain| {
        let found = chain.mean_ms(summary.sim_time, &summary.chains)?;
        Some((found / chain.bag.as_ref()?.mean_ms).ln().abs())
    });
    Some(far.sum())
}

/// Returns the durations in a table.
fn durations(table: &ValueTable) -> Vec<Duration> {
    table
        .text
        .lines()
        .skip(1)
        .filter_map(|line| millis::parse(line).ok())
        .collect()
}

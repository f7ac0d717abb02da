//! Nodes that share a thread: what gets ready during a run of the other ends after it.

use crate::numbers::{MS, quantile};

/// The fewest runs of a node that is looked at.
const MIN_COUNT: usize = 50;

/// The most nodes that are looked at, each with each other one.
const MOST: usize = 100;

/// The fewest runs that are expected to end during another one.
const MIN_EXPECTED: f64 = 30.0;

/// The part of them that may be seen.
const MAX_SEEN: f64 = 0.1;

/// Runs this close to an end of another one tell nothing (ns).
const MARGIN: i64 = MS / 10;

/// Which nodes share a thread, by their places.
#[derive(Debug, Default)]
pub struct NodeThreads {
    /// Groups of nodes that do.
    pub shared: Vec<Vec<usize>>,
    /// Nodes that may: too few runs met to tell.
    pub undecided: Vec<(usize, usize)>,
}

impl NodeThreads {
    /// Finds them by the start and end of each run of each node (ns).
    pub fn new(runs: &[Vec<(i64, i64)>]) -> Self {
        let mut threads = Self::default();
        let runs = &runs[..runs.len().min(MOST)];
        for (one, of_one) in runs.iter().enumerate() {
            for (other, of_other) in runs.iter().enumerate().skip(one + 1) {
                if of_one.len() < MIN_COUNT || of_other.len() < MIN_COUNT {
                    continue;
                }
                let (expected, seen) = during(of_one, of_other);
                let (others_expected, others_seen) = during(of_other, of_one);
                let (expected, seen) = (expected + others_expected, seen + others_seen);
                if seen as f64 > MAX_SEEN * expected {
                    continue;
                }
                if expected >= MIN_EXPECTED {
                    join(&mut threads.shared, one, other);
                } else {
                    threads.undecided.push((one, other));
                }
            }
        }
        threads
    }
}

/// Puts both into one group.
fn join(groups: &mut Vec<Vec<usize>>, one: usize, other: usize) {
    let mut group = vec![one, other];
    groups.retain(|known| {
        let is_apart = !known.contains(&one) && !known.contains(&other);
        if !is_apart {
            group.extend(known);
        }
        is_apart
    });
    group.sort_unstable();
    group.dedup();
    groups.push(group);
}

/// Returns the runs of `u` that are expected to end during a run of `v` in which they got ready,
/// and those that did.
fn during(u: &[(i64, i64)], v: &[(i64, i64)]) -> (f64, usize) {
    let (mut others, mut within) = (Vec::new(), Vec::new());
    for (start, end) in u {
        let next = v.partition_point(|(begin, _)| begin + MARGIN < *start);
        let around = next.checked_sub(1).map(|place| v[place]);
        let cost = end.saturating_sub(*start);
        match around.filter(|(_, end)| *start < end - MARGIN) {
            Some((_, end)) => within.push((end - start, cost)),
            None => others.push(cost),
        }
    }
    let least = quantile(&mut others, 50);
    others.sort_unstable();
    let (mut expected, mut seen) = (0.0, 0);
    for (rest, cost) in within {
        let limit = rest.saturating_add(least / 2);
        let shorter = others.partition_point(|cost| *cost < limit);
        expected += shorter as f64 / others.len().max(1) as f64;
        seen += usize::from(cost < limit);
    }
    (expected, seen)
}

/// For each end of a node the last end of any node on its thread before.
pub fn busy_until(ends: &[i64], of_thread: &[&[i64]]) -> Vec<i64> {
    let mut all: Vec<i64> = of_thread
        .iter()
        .flat_map(|ends| ends.iter().copied())
        .collect();
    all.sort_unstable();
    let before = |end: &i64| {
        let place = all.partition_point(|other| other < end);
        place
            .checked_sub(1)
            .map_or(crate::triggered::LONG_AGO, |place| all[place])
    };
    ends.iter().map(before).collect()
}

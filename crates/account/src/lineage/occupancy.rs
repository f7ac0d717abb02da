//! Who had the threads of an executor: while a tick waited for one, and while it was set aside.

use std::time::Duration;

use ratelab::Time;
use ratelab_effects::Executor;

use super::{Lineage, TracedTick};

/// The end of a long wait that counts for its cause: waits of overloaded nodes grow with the run.
const LOOKED_AT: Duration = Duration::from_millis(200);

/// A stretch of run time in which another node had what a tick needed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Occupied {
    /// Its begin (run time).
    pub from: Time,
    /// Its end (run time).
    pub to: Time,
    /// The node that had it, as an index into the topology.
    pub by: usize,
}

impl Lineage {
    /// The other nodes on the threads of a node's executor.
    pub(super) fn companions(&self, node: usize) -> impl Iterator<Item = usize> {
        let nodes = &self.topology.nodes;
        let executor = nodes[node].executor_index;
        let others = (0..nodes.len()).filter(move |other| *other != node);
        others.filter(move |other| executor.is_some() && nodes[*other].executor_index == executor)
    }

    /// The wait of a tick for its executor, with the node that ran the longest meanwhile, or in
    /// the last 200 ms of it. Of several threads one may be free: then a node of its callback
    /// group is what it waited for.
    /// `None` if it did not wait, or had a thread of its own.
    pub fn waited(&self, node: usize, index: usize) -> Option<Occupied> {
        let to = self.nodes[node].ticks.get(index)?.tick.at;
        let from = self.released(node, index);
        let late = from.max(Time::ZERO + to.since(Time::ZERO + LOOKED_AT));
        let longest = self
            .companions(node)
            .map(|other| (self.ran(other, late, to), other))
            .filter(|(ran, _)| !ran.is_zero())
            .max_by_key(|(ran, other)| {
                let first = std::cmp::Reverse(*other);
                (self.excludes(node, *other), *ran, first)
            });
        let (_, by) = longest?;
        (from < to).then_some(Occupied { from, to, by })
    }

    /// Whether two nodes are in one mutually exclusive group of an executor with several threads.
    fn excludes(&self, node: usize, other: usize) -> bool {
        let [one, other] = [node, other].map(|node| &self.topology.nodes[node]);
        let executor = self.nodes[node].executor;
        let several = matches!(executor, Some(Executor::Multi { threads: 2.. }));
        several && one.group.is_some() && one.group == other.group
    }

    /// The time for which a node had a core between two run times.
    fn ran(&self, node: usize, from: Time, to: Time) -> Duration {
        let overlap = |begin: Time, end: Time| end.min(to).since(begin.max(from));
        let ticks = self.ticks_between(node, from, to);
        let ran = ticks.map(|(index, worked)| {
            let aside = self.set_aside(node, index);
            let aside = aside.iter().map(|part| overlap(part.from, part.to));
            overlap(worked.tick.at, worked.ends()).saturating_sub(aside.sum())
        });
        ran.sum()
    }

    /// The stretches for which a tick was set aside for more urgent ones, on a preemptive
    /// executor with one core: on several cores the ticks alone do not tell.
    pub fn set_aside(&self, node: usize, index: usize) -> Vec<Occupied> {
        let one = Executor::FixedPriority { cores: 1 };
        let preemptive = [one, Executor::Edf { cores: 1 }];
        let known = self.nodes[node].executor;
        let ticks = &self.nodes[node].ticks;
        let (true, Some(own)) = (
            known.is_some_and(|known| preemptive.contains(&known)),
            ticks.get(index),
        ) else {
            return Vec::new();
        };
        // What begins during a tick is more urgent, and ends before it goes on.
        let inside =
            |worked: &&TracedTick| worked.tick.at > own.tick.at && worked.tick.at < own.ends();
        let others = self.companions(node).flat_map(|other| {
            let ticks = self.ticks_between(other, own.tick.at, own.ends());
            let ticks = ticks.map(|(_, worked)| worked).filter(inside);
            ticks.map(move |worked| Occupied {
                from: worked.tick.at,
                to: worked.ends().min(own.ends()),
                by: other,
            })
        });
        outermost(others.collect())
    }
}

/// The stretches that are in no other one, in order.
fn outermost(mut stretches: Vec<Occupied>) -> Vec<Occupied> {
    stretches.sort_by_key(|stretch| (stretch.from, std::cmp::Reverse(stretch.to)));
    let mut until = Time::ZERO;
    stretches.retain(|stretch| {
        let outside = stretch.to > until;
        until = until.max(stretch.to);
        outside
    });
    stretches
}

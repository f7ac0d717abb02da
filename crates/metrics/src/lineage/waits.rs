//! What a tick waited for before it began, for what it was set aside, and what waits in the queue
//! of a topic.

use std::{collections::VecDeque, time::Duration};

use ratelab::{Time, TimeSpan};

use super::{Lineage, TracedTick};

/// Only this last part of a wait decides its cause: waits of overloaded nodes grow without bound.
const LOOKED_AT: Duration = Duration::from_millis(200);

/// A stretch of run time in which a tick did not go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TickWait {
    /// Its begin (run time).
    pub from: Time,
    /// Its end (run time).
    pub to: Time,
    /// What was missing.
    pub what: WaitsFor,
}

/// What a tick waits for; nodes and topics are indices into the topology.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WaitsFor {
    /// A message of this topic, to match that of another one.
    Match(usize),
    /// The executor, which had this node meanwhile.
    Node(usize),
    /// A thread.
    Thread,
}

impl Lineage {
    /// Returns the waits of a tick before it began: for a match, then for its executor or its
    /// thread.
    pub fn waits(&self, node: usize, index: usize) -> Vec<TickWait> {
        let Some(TracedTick { tick, .. }) = self.nodes[node].ticks.get(index) else {
            return Vec::new();
        };
        let (from, to, what) = (tick.due(), tick.at, WaitsFor::Thread);
        let late = TickWait { from, to, what };
        let begins = self.waited(node, index).unwrap_or(late);
        self.waited_for_match(node, index)
            .into_iter()
            .chain([begins])
            .filter(|wait| wait.from < wait.to)
            .collect()
    }

    /// Returns the longest wait for a match among the messages of a tick, from the end of the tick
    /// before. `None` if none of them waited.
    fn waited_for_match(&self, node: usize, index: usize) -> Option<TickWait> {
        let ticks = &self.nodes[node].ticks;
        let reads = ticks[index].reads();
        let before = index.checked_sub(1);
        let free = before.map_or(Time::ZERO, |before| ticks[before].ends());
        let to = ticks[index].tick.due();
        let waits = reads.filter_map(|message| {
            let other = self.waited_for(node, index, message.topic)?;
            let arrives = self.head(message)?.arrives?;
            Some(TickWait {
                from: arrives.max(free),
                to,
                what: WaitsFor::Match(other),
            })
        });
        waits.min_by_key(|wait| wait.from)
    }

    /// Returns the wait of a tick for its executor, with the node that ran the longest meanwhile,
    /// or in the last 200 ms of it. Of several threads one may be free: then a node of its callback
    /// group is what it waited for.
    /// `None` if it did not wait, or had a thread of its own.
    fn waited(&self, node: usize, index: usize) -> Option<TickWait> {
        let to = self.nodes[node].ticks[index].tick.at;
        let from = self.released(node, index);
        let late = from.max(to - LOOKED_AT);
        let longest = self
            .companions(node)
            .map(|other| (self.ran(other, late, to), other))
            .filter(|(ran, _)| !ran.is_zero())
            .max_by_key(|(ran, other)| {
                let first = std::cmp::Reverse(*other);
                (self.excludes(node, *other), *ran, first)
            });
        let what = WaitsFor::Node(longest?.1);
        Some(TickWait { from, to, what })
    }

    /// Returns the other nodes on the threads of a node's executor.
    pub(super) fn companions(&self, node: usize) -> impl Iterator<Item = usize> {
        let nodes = &self.topology.nodes;
        let executor = nodes[node].executor_index;
        let others = (0..nodes.len()).filter(move |other| *other != node);
        others.filter(move |other| executor.is_some() && nodes[*other].executor_index == executor)
    }

    /// Returns whether two nodes are in one mutually exclusive group of an executor with several
    /// threads.
    fn excludes(&self, node: usize, other: usize) -> bool {
        let [one, other] = [node, other].map(|node| &self.topology.nodes[node]);
        let executor = self.nodes[node].executor;
        let several = executor
            .is_some_and(|executor| executor.kind().has_groups && executor.shares() > Some(1));
        several && one.group.is_some() && one.group == other.group
    }

    /// Returns the time for which a node had a core between two run times.
    fn ran(&self, node: usize, from: Time, to: Time) -> Duration {
        let overlap = |begin: Time, end: Time| end.min(to).since(begin.max(from));
        let ticks = self.ticks_within(node, TimeSpan { from, to });
        let ran = ticks.map(|(index, worked)| {
            let aside = self.set_aside(node, index);
            let aside = aside.iter().map(|part| overlap(part.from, part.to));
            overlap(worked.tick.at, worked.ends()).saturating_sub(aside.sum())
        });
        ran.sum()
    }

    /// Returns the stretches for which a tick was set aside for more urgent ones, on a preemptive
    /// executor with one core: on several cores the ticks alone do not tell.
    pub fn set_aside(&self, node: usize, index: usize) -> Vec<TickWait> {
        let own = self.nodes[node].ticks.get(index);
        let executor = self.nodes[node].executor;
        let is_preemptive = executor
            .is_some_and(|executor| !executor.kind().has_groups && executor.shares() == Some(1));
        let Some(own) = own.filter(|_| is_preemptive) else {
            return Vec::new();
        };
        // What begins during a tick is more urgent, and ends before it goes on.
        let inside =
            |worked: &&TracedTick| worked.tick.at > own.tick.at && worked.tick.at < own.ends();
        let others = self.companions(node).flat_map(|other| {
            self.ticks_within(other, TimeSpan::new(own.tick.at, own.ends()))
                .map(|(_, worked)| worked)
                .filter(inside)
                .map(move |worked| TickWait {
                    from: worked.tick.at,
                    to: worked.ends().min(own.ends()),
                    what: WaitsFor::Node(other),
                })
        });
        outermost(others.collect())
    }
}

/// Returns the stretches that are in no other one, in order.
fn outermost(mut stretches: Vec<TickWait>) -> Vec<TickWait> {
    stretches.sort_by_key(|stretch| (stretch.from, std::cmp::Reverse(stretch.to)));
    let mut until = Time::ZERO;
    stretches.retain(|stretch| {
        let outside = stretch.to > until;
        until = until.max(stretch.to);
        outside
    });
    stretches
}

impl Lineage {
    /// Returns the number of messages in the queue of a topic that a reader has still to read, at
    /// each change.
    pub fn queue(&self, topic: usize, reader: usize) -> Vec<(Time, usize)> {
        let record = &self.topics[topic];
        let arrivals = record
            .sent
            .iter()
            .filter_map(|sent| Some((sent.arrives?, false, sent.seq)));
        let reads = self.nodes[reader].ticks.iter().filter_map(|worked| {
            let read = worked.read_of(topic)?;
            Some((worked.tick.at, true, read.seq))
        });
        let mut changes: Vec<_> = arrivals.chain(reads).collect();
        changes.sort_unstable();
        let mut waiting: VecDeque<u64> = VecDeque::new();
        let mut read_until = None;
        let mut lengths = Vec::new();
        for (at, is_read, seq) in changes {
            if is_read {
                read_until = read_until.max(Some(seq));
                waiting.retain(|waits| *waits > seq);
            } else if waiting.back().copied().max(read_until) < Some(seq) {
                // It was not overtaken.
                waiting.push_back(seq);
                while waiting.len() > record.depth(at) {
                    waiting.pop_front();
                }
            }
            lengths.push((at, waiting.len()));
        }
        lengths.dedup_by_key(|(_, length)| *length);
        lengths
    }
}

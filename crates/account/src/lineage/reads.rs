//! The reads of each tick, derived from the deliveries before it.

use ratelab::{ReadOrder, Time};

use super::{Lineage, Sent, TracedTopic};

impl TracedTopic {
    /// The message with this sequence number.
    pub(super) fn message(&self, seq: u64) -> Option<&Sent> {
        let index = self.sent.partition_point(|sent| sent.seq < seq);
        self.sent.get(index).filter(|sent| sent.seq == seq)
    }

    /// Messages published by run time `until` after message number `seq`, oldest first;
    /// all of them without a `seq`.
    pub(super) fn after(
        &self,
        seq: Option<u64>,
        until: Time,
    ) -> impl DoubleEndedIterator<Item = &Sent> {
        let first = seq.map_or(0, |seq| self.sent.partition_point(|sent| sent.seq <= seq));
        let last = self.sent.partition_point(|sent| sent.released <= until);
        self.sent.range(first.min(last)..last)
    }

    /// The read order at run time `at`.
    fn order(&self, at: Time) -> ReadOrder {
        let known = self.rules.iter().rev().find(|(since, ..)| *since <= at);
        known.map_or(ReadOrder::Newest, |(_, order, _)| *order)
    }

    /// The smallest queue depth between two run times.
    pub(super) fn least_depth(&self, from: Time, to: Time) -> usize {
        let first = self.rules.partition_point(|(since, ..)| *since <= from);
        let last = self.rules.partition_point(|(since, ..)| *since <= to);
        let rules = &self.rules[first.saturating_sub(1)..last];
        let depths = rules.iter().map(|(.., depth)| depth.get());
        depths.min().unwrap_or(1)
    }

    /// The oldest message of `news`, in the order of delivery, that is still in the queue
    /// at run time `at`.
    fn oldest_kept<'a>(&self, news: &[&'a Sent], at: Time) -> Option<&'a Sent> {
        let (mut oldest, mut until, mut evicted) = (None, at, 0);
        for (index, sent) in news.iter().enumerate().rev() {
            // All messages before `evicted` were evicted by `until`.
            if index < evicted {
                break;
            }
            oldest = Some(*sent);
            let from = sent.arrives.unwrap_or(until);
            let depth = self.least_depth(from, until);
            evicted = evicted.max((index + 1).saturating_sub(depth));
            until = from;
        }
        oldest
    }
}

impl Lineage {
    /// The reads of the tick with this index of a node, as pairs of a topic and a
    /// sequence number.
    pub(super) fn reads_of(&mut self, node: usize, index: usize) -> Vec<(usize, u64)> {
        let met = match self.topology.nodes[node].triggers.len() {
            0 | 1 => Vec::new(),
            _ => self.met(node, index),
        };
        let record = &self.nodes[node];
        let at = record.ticks[index].tick.at;
        let before = index.checked_sub(1).map(|before| &record.ticks[before]);
        let inputs = record.inputs.iter();
        let read = |&topic: &usize| {
            if let Some(set) = met.iter().find(|(of, _)| *of == topic) {
                return Some(*set);
            }
            let last = before.and_then(|tick| tick.read(topic));
            let read = self.to_read(topic, node, at, last)?;
            Some((topic, read))
        };
        inputs.filter_map(read).collect()
    }

    /// The sequence number read by a tick at `at` after a tick that read `last`.
    fn to_read(&self, topic: usize, node: usize, at: Time, last: Option<u64>) -> Option<u64> {
        let record = &self.topics[topic];
        let order = match self.topology.nodes[node].triggers[..] {
            [only] if only == topic => ReadOrder::Oldest,
            _ => record.order(at),
        };
        let next = match order {
            ReadOrder::Newest => self.news(topic, node, at, last).next_back(),
            ReadOrder::Oldest => self.oldest(topic, node, at, last),
        };
        next.map(|sent| sent.seq).or(last)
    }

    /// The messages after `last` that a tick of `node` at run time `at` finds delivered.
    fn news(
        &self,
        topic: usize,
        node: usize,
        at: Time,
        last: Option<u64>,
    ) -> impl DoubleEndedIterator<Item = &Sent> {
        let after = self.topics[topic].after(last, at);
        after.filter(move |sent| self.is_seen(topic, sent, node, at))
    }

    /// The oldest of them that the queue of the topic still keeps.
    pub(super) fn oldest(
        &self,
        topic: usize,
        node: usize,
        at: Time,
        last: Option<u64>,
    ) -> Option<&Sent> {
        let mut queue: Vec<&Sent> = Vec::new();
        for sent in self.news(topic, node, at, last).rev() {
            // A delivery after that of a newer message is overtaken.
            if queue
                .last()
                .is_none_or(|newer| sent.arrives <= newer.arrives)
            {
                queue.push(sent);
            }
        }
        queue.reverse();
        self.topics[topic].oldest_kept(&queue, at)
    }

    /// Whether a tick of `node` at run time `at` finds `sent` delivered.
    pub(super) fn is_seen(&self, topic: usize, sent: &Sent, node: usize, at: Time) -> bool {
        match sent.arrives {
            Some(arrives) if arrives == at && sent.released == at => {
                self.is_last(node) || !self.follows(topic, node, at)
            }
            Some(arrives) => arrives <= at,
            None => false,
        }
    }

    /// Whether a node begins after all else at an instant: messages trigger it, or its
    /// executor picks it.
    fn is_last(&self, node: usize) -> bool {
        let node = &self.topology.nodes[node];
        !node.triggers.is_empty() || node.executor.is_some()
    }

    /// Whether a message published to a topic at run time `at` is from a tick after that
    /// of `reader` at the same instant. The ends of ticks come first, then due ticks, by
    /// priority.
    fn follows(&self, topic: usize, reader: usize, at: Time) -> bool {
        let rank = |node: usize| (self.topology.nodes[node].priority, node);
        let publishers = self.topology.topics[topic].publishers.iter();
        let mut at_once = publishers.filter(|&&node| {
            let record = &self.nodes[node];
            let first = record.ticks.partition_point(|worked| worked.tick.at < at);
            let before = first.checked_sub(1).map(|before| &record.ticks[before]);
            before.is_none_or(|before| before.ends() != at)
        });
        at_once.any(|&node| rank(node) >= rank(reader))
    }
}

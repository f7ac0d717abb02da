//! The reads of each tick, derived from the deliveries before it.

use std::collections::VecDeque;

use ratelab::{Head, ReadOrder, Time};

use super::{Lineage, TracedTopic};

impl TracedTopic {
    /// The message with this sequence number.
    pub(super) fn message(&self, seq: u64) -> Option<&Head> {
        let index = self.sent.partition_point(|sent| sent.seq < seq);
        self.sent.get(index).filter(|sent| sent.seq == seq)
    }

    /// Messages published by run time `until` after message number `seq`, oldest first;
    /// all of them without a `seq`.
    pub(super) fn after(
        &self,
        seq: Option<u64>,
        until: Time,
    ) -> impl DoubleEndedIterator<Item = &Head> {
        let first = seq.map_or(0, |seq| self.sent.partition_point(|sent| sent.seq <= seq));
        let last = self.sent.partition_point(|sent| sent.at <= until);
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
    fn oldest_kept<'a>(&self, news: &[&'a Head], at: Time) -> Option<&'a Head> {
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
    ) -> impl DoubleEndedIterator<Item = &Head> {
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
    ) -> Option<&Head> {
        let mut queue: Vec<&Head> = Vec::new();
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

    /// The number of messages in the queue of a topic that a reader has still to read, at
    /// each change.
    pub fn queue(&self, topic: usize, reader: usize) -> Vec<(Time, usize)> {
        let record = &self.topics[topic];
        let arrivals = record
            .sent
            .iter()
            .filter_map(|sent| Some((sent.arrives?, Some(sent.seq), 0)));
        let reads = self.nodes[reader].ticks.iter();
        let reads = reads.filter_map(|worked| Some((worked.tick.at, None, worked.read(topic)?)));
        let mut changes: Vec<_> = arrivals.chain(reads).collect();
        changes.sort_by_key(|(at, arrived, _)| (*at, arrived.is_none()));
        let mut waiting: VecDeque<u64> = VecDeque::new();
        let mut read_until = None;
        let mut lengths = Vec::new();
        for (at, arrived, read) in changes {
            match arrived {
                Some(seq) if waiting.back().copied().max(read_until) < Some(seq) => {
                    waiting.push_back(seq);
                    while waiting.len() > record.least_depth(at, at) {
                        waiting.pop_front();
                    }
                }
                Some(_) => {} // An overtaken message.
                None => {
                    read_until = read_until.max(Some(read));
                    waiting.retain(|seq| *seq > read);
                }
            }
            lengths.push((at, waiting.len()));
        }
        lengths.dedup_by_key(|(_, length)| *length);
        lengths
    }

    /// Whether a tick of `node` at run time `at` finds `sent` delivered.
    pub(super) fn is_seen(&self, topic: usize, sent: &Head, node: usize, at: Time) -> bool {
        match sent.arrives {
            Some(arrives) if arrives == at && sent.at == at => {
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

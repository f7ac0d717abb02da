//! Traffic through nodes and queues.

use std::collections::VecDeque;

use ratelab::Time;

use super::{Lineage, PushInForce};

impl Lineage {
    /// The messages published by the tick with this index of a node, as topics and
    /// sequence numbers.
    pub fn made(&self, node: usize, index: usize) -> Vec<(usize, u64)> {
        let Some(worked) = self.nodes[node].ticks.get(index) else {
            return Vec::new();
        };
        let topics = self.topology.topics.iter().enumerate();
        let outputs = topics.filter(|(_, topic)| topic.publishers.contains(&node));
        let made = outputs.flat_map(|(topic, _)| {
            let sent = &self.topics[topic].sent;
            let first = sent.partition_point(|sent| sent.released < worked.ends());
            let last = sent.partition_point(|sent| sent.released <= worked.ends());
            let seqs = sent.range(first..last).map(|sent| sent.seq);
            seqs.map(move |seq| (topic, seq))
        });
        made.filter(|(topic, seq)| self.made_by(*topic, *seq) == Some((node, index)))
            .collect()
    }

    /// All pushes of a node with known chains, oldest first.
    pub fn pushes(&self, node: usize) -> Vec<PushInForce> {
        let mut pushes: Vec<PushInForce> = Vec::new();
        for index in 0..self.nodes[node].ticks.len() {
            let read = self.applied_by(node, index);
            let again = pushes.last().map(|push| (push.topic, push.seq));
            if read != again {
                pushes.extend(self.push_of(node, index));
            }
        }
        pushes
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
}

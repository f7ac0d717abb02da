//! What waits in the queue of a topic, for a look at it.

use std::collections::VecDeque;

use ratelab::Time;

use super::Lineage;

impl Lineage {
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
                    while waiting.len() > record.depth(at) {
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

//! What waits in the queue of a topic, for a look at it.

use std::collections::VecDeque;

use ratelab::Time;

use super::Lineage;

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

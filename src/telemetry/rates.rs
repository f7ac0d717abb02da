//! The rates of nodes, and of the messages that trigger nodes.

use super::Observer;
use crate::{sync::atomic::Ordering, time::Hz};

impl Observer {
    /// The rate in force of each node. For a node that messages trigger it is that of the
    /// messages: of all publishers of a topic together, and of several topics the slowest.
    pub(crate) fn rates(&self) -> Vec<Hz> {
        let mut known: Vec<Option<u64>> = self
            .nodes
            .iter()
            .map(|node| {
                let own = node.counters.micro_hz.load(Ordering::Relaxed);
                node.triggers.is_empty().then_some(own)
            })
            .collect();
        for node in 0..self.nodes.len() {
            self.find_rate(node, &mut known);
        }
        let rates = known.into_iter().map(|rate| {
            let micro = rate.unwrap_or_default();
            Hz::from_micro(micro.clamp(Hz::MIN.as_micro(), Hz::MAX.as_micro()))
        });
        rates.collect()
    }

    /// Finds the rate of a node, after those of all nodes before it in chains of triggers.
    fn find_rate(&self, node: usize, known: &mut [Option<u64>]) {
        let mut path = vec![node];
        while let Some(&node) = path.last() {
            let triggers = self.nodes[node].triggers.iter();
            let mut before = triggers.flat_map(|topic| &self.topics[*topic].publishers);
            // There are no circles of triggers.
            match before.find(|publisher| known[**publisher].is_none()) {
                Some(unknown) if known[node].is_none() => path.push(*unknown),
                _ => {
                    let rate = self.rate_of_messages(node, known);
                    known[node].get_or_insert(rate);
                    path.pop();
                }
            }
        }
    }

    fn rate_of_messages(&self, node: usize, known: &[Option<u64>]) -> u64 {
        let topics = self.nodes[node].triggers.iter();
        let rates = topics.map(|topic| {
            let publishers = self.topics[*topic].publishers.iter();
            publishers.filter_map(|publisher| known[*publisher]).sum()
        });
        rates.min().unwrap_or_default()
    }
}

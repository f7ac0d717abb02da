//! Comparison of two runs, bit for bit.

use std::hash::{DefaultHasher, Hash, Hasher};

use ratelab::Head;
use ratelab_metrics::TickRecord;

/// Maximum number of digests per topic or node.
const MAX_DIGESTS: usize = 1 << 20;

/// Running digests of a run: one after each message and each tick, so that any beginning
/// of a run can be compared with the same beginning of another one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunDigest {
    topics: Vec<Vec<u64>>,
    nodes: Vec<Vec<u64>>,
}

impl RunDigest {
    /// Adds a message of the topic with index `topic`, bit for bit.
    pub fn message(&mut self, topic: usize, head: &Head, row: &[f64]) {
        let bits = row.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        let head = (
            head.stamp,
            head.seq,
            head.origin,
            head.arrives,
            head.dropped,
        );
        add(place(&mut self.topics, topic), (head, bits));
    }

    /// Adds a tick of the node with index `node`, without its wall time.
    pub fn tick(&mut self, node: usize, tick: &TickRecord) {
        let tick = (
            tick.number,
            tick.at,
            tick.ends,
            tick.lateness,
            tick.overruns,
        );
        add(place(&mut self.nodes, node), tick);
    }

    /// Returns whether this run equals `other` up to the end of the shorter one; `whole` if both
    /// must have the same length.
    pub fn is_same(&self, other: &Self, whole: bool) -> bool {
        let topics = self.topics.iter().zip(&other.topics);
        let mut pairs = topics.chain(self.nodes.iter().zip(&other.nodes));
        let alike = |(one, other): (&Vec<u64>, &Vec<u64>)| {
            let both = one.len().min(other.len());
            let same = one[..both].last() == other[..both].last();
            same && (!whole || one.len() == other.len())
        };
        !self.topics.is_empty() && pairs.all(alike)
    }
}

fn place(series: &mut Vec<Vec<u64>>, index: usize) -> &mut Vec<u64> {
    if series.len() <= index {
        series.resize(index + 1, Vec::new());
    }
    &mut series[index]
}

fn add(digests: &mut Vec<u64>, item: impl Hash) {
    if digests.len() == MAX_DIGESTS {
        return;
    }
    let mut hasher = DefaultHasher::new();
    digests.last().hash(&mut hasher);
    item.hash(&mut hasher);
    digests.push(hasher.finish());
}

#[cfg(test)]
mod tests {
    use ratelab::Time;

    use super::*;
    use crate::tests::sample::head;

    fn digest(values: &[f64]) -> RunDigest {
        let mut digest = RunDigest::default();
        for (seq, value) in (0..).zip(values) {
            digest.message(0, &head(seq, Time::from_nanos(seq), None), &[*value]);
        }
        digest
    }

    #[test]
    fn a_run_is_the_same_if_every_bit_is() {
        let run = digest(&[1.0, 0.0, 3.0]);
        assert!(run.is_same(&digest(&[1.0, 0.0, 3.0]), true));
        assert!(!run.is_same(&digest(&[1.0, -0.0, 3.0]), true));
        assert!(!run.is_same(&digest(&[1.0, -0.0]), false));
        assert!(run.is_same(&digest(&[1.0, 0.0]), false));
        assert!(!run.is_same(&digest(&[1.0, 0.0]), true));
        assert!(!RunDigest::default().is_same(&run, false));
    }
}

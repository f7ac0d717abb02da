//! The nodes from which data comes.

use ratelab::Topology;

/// `last` and the nodes whose messages reach it, the nearest first.
pub fn upstream(topology: &Topology, last: usize) -> Vec<usize> {
    let mut path = vec![last];
    let mut next = 0;
    while let Some(&reader) = path.get(next) {
        let topics = topology.topics.iter();
        let read = topics.filter(|topic| topic.readers.contains(&reader));
        for node in read.flat_map(|topic| topic.publishers.iter().copied()) {
            if !path.contains(&node) {
                path.push(node);
            }
        }
        next += 1;
    }
    path
}

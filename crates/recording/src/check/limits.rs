//! Limits of a file: the range of what a recorder writes.

use std::collections::HashSet;

use ratelab::Topology;

/// Maximum number of nodes, topics, ends of topics and meters together in a graph. Each
/// may take half a megabyte in a replay; the cart-pole has 12.
const PARTS: usize = 256;

/// Checks the graph of a recording: its size, unique names, and an existing node at every
/// end of a topic.
///
/// # Errors
/// A description of the error.
pub fn check_graph(topology: &Topology) -> Result<(), String> {
    let Topology { nodes, topics } = topology;
    let meters: usize = nodes.iter().map(|node| 1 + node.meters.len()).sum();
    let ends = |list: &[usize]| list.len();
    let topic_ends = topics
        .iter()
        .map(|topic| 1 + ends(&topic.publishers) + ends(&topic.readers));
    let parts = meters + topic_ends.sum::<usize>();
    if parts > PARTS {
        return Err(format!(
            "the graph in this recording has {parts} parts (nodes, topics, their ends, meters): \
             up to {PARTS} are read"
        ));
    }
    let at_nodes = |list: &[usize]| are_distinct(list) && list.iter().all(|n| *n < nodes.len());
    let sound = are_distinct(nodes.iter().map(|node| &node.name))
        && are_distinct(topics.iter().map(|topic| &topic.name))
        && nodes.iter().all(|node| are_distinct(&node.meters))
        && topics
            .iter()
            .all(|topic| at_nodes(&topic.publishers) && at_nodes(&topic.readers));
    sound
        .then_some(())
        .ok_or_else(|| "the graph in this recording is damaged".to_owned())
}

fn are_distinct<T: Eq + std::hash::Hash>(items: impl IntoIterator<Item = T>) -> bool {
    let mut seen = HashSet::new();
    items.into_iter().all(|item| seen.insert(item))
}

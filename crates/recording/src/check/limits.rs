//! Limits of a file: the range of what a recorder writes.

use std::collections::HashSet;

use ratelab::Topology;

use super::DescriptionError;

/// Maximum number of nodes, topics, ends of topics and meters together in a graph. Each
/// may take half a megabyte in a replay; the cart-pole has 12.
const MAX_PARTS: usize = 256;

/// Checks the graph of a recording: its size, unique names, and an existing node at every
/// end of a topic.
///
/// # Errors
/// [`DescriptionError`] for a graph that no recorder writes.
pub fn check_graph(topology: &Topology) -> Result<(), DescriptionError> {
    let Topology { nodes, topics } = topology;
    let meters: usize = nodes.iter().map(|node| 1 + node.meters.len()).sum();
    let ends = |list: &[usize]| list.len();
    let topic_ends = topics
        .iter()
        .map(|topic| 1 + ends(&topic.publishers) + ends(&topic.readers));
    let parts = meters + topic_ends.sum::<usize>();
    if parts > MAX_PARTS {
        return Err(DescriptionError::LargeGraph {
            parts,
            max: MAX_PARTS,
        });
    }
    let at_nodes = |list: &[usize]| are_distinct(list) && list.iter().all(|n| *n < nodes.len());
    let sound = are_distinct(nodes.iter().map(|node| &node.name))
        && are_distinct(topics.iter().map(|topic| &topic.name))
        && nodes.iter().all(|node| are_distinct(&node.meters))
        && topics
            .iter()
            .all(|topic| at_nodes(&topic.publishers) && at_nodes(&topic.readers));
    sound.then_some(()).ok_or(DescriptionError::DamagedGraph)
}

fn are_distinct<T: Eq + std::hash::Hash>(items: impl IntoIterator<Item = T>) -> bool {
    let mut seen = HashSet::new();
    items.into_iter().all(|item| seen.insert(item))
}

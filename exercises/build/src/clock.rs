//! A virtual clock: no threads, no waiting.

use crate::Node;

/// Ticks `nodes` in the order of their turns until `end` (ns). If a node ends the run
/// before, returns its name and when that was.
pub fn run(nodes: &mut [Node<'_>], end: u64) -> Option<(String, u64)> {
    while let Some(node) = nodes.iter_mut().min_by_key(|node| node.turn()) {
        let (due, _) = node.turn();
        if due > end {
            return None;
        }
        if !node.tick() {
            return Some((node.name().to_owned(), due));
        }
    }
    None
}

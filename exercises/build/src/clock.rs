//! A virtual clock: no threads, no waiting.

use crate::Node;

/// Ticks `nodes` in the order of their turns until `end` (ns), or until one ends the run.
pub fn run(nodes: &mut [Node<'_>], end: u64) {
    while let Some(node) = nodes.iter_mut().min_by_key(|node| node.turn()) {
        if node.turn().0 > end || !node.tick() {
            return;
        }
    }
}

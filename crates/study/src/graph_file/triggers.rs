//! Nodes that trigger each other in a circle.

use super::{GraphFile, error::Placed};

impl GraphFile {
    /// A topic between nodes that trigger each other in a circle, and their names, if there are
    /// such nodes.
    pub(super) fn trigger_circle(&self) -> Option<(&Placed, String)> {
        let mut rest: Vec<usize> = (0..self.nodes.len()).collect();
        while !rest.is_empty() {
            let waits = |node: &usize| self.trigger_from(*node, &rest).is_some();
            let waiting: Vec<usize> = rest.iter().copied().filter(waits).collect();
            if waiting.len() == rest.len() {
                return Some(self.circle(&waiting));
            }
            rest = waiting;
        }
        None
    }

    /// A topic that triggers `node`, with its publisher among `nodes`, if there is one.
    fn trigger_from(&self, node: usize, nodes: &[usize]) -> Option<(&Placed, usize)> {
        let triggers = &self.nodes[node].triggers;
        triggers.iter().find_map(|topic| {
            let mut nodes = nodes.iter().copied();
            let publisher = nodes.find(|node| self.nodes[*node].publishes(&topic.text));
            Some((topic, publisher?))
        })
    }

    /// A circle among nodes, each of which one of the others triggers.
    fn circle(&self, nodes: &[usize]) -> (&Placed, String) {
        let mut way: Vec<(&Placed, usize)> = Vec::new();
        let mut node = nodes[0];
        let begin = loop {
            if let Some(begin) = way.iter().position(|(_, known)| *known == node) {
                break begin;
            }
            // Each of them has one.
            let Some((topic, publisher)) = self.trigger_from(node, nodes) else {
                break 0;
            };
            way.push((topic, node));
            node = publisher;
        };
        let nodes = way[begin..].iter().map(|(_, node)| *node).chain([node]);
        let names = nodes.rev().map(|node| self.nodes[node].name.as_str());
        (way[begin].0, names.collect::<Vec<_>>().join(" → "))
    }
}

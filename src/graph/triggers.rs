//! Checks of the topics that trigger a node.

use super::{ControlPlane, GraphError, new_node::NewNode};
use crate::scheduling::Release;

/// Checks the topics that trigger a new node, which publishes to others.
pub(super) fn check(
    graph: &ControlPlane,
    new: &NewNode<'_>,
    (triggers, publishes): (&[usize], &[usize]),
) -> Result<(), GraphError> {
    let name = new.name;
    match (&new.release, triggers) {
        (Release::On(_), []) => Err(GraphError::NoTrigger(name.to_owned())),
        (Release::AtRate(_), [_, ..]) => Err(GraphError::TriggerAtRate(name.to_owned())),
        (Release::AtRate(_), []) => Ok(()),
        (Release::On(_), triggers) => match graph.circle(name, triggers, publishes) {
            Some(circle) => Err(GraphError::TriggerCycle(circle)),
            None => Ok(()),
        },
    }
}

impl ControlPlane {
    /// Returns the way from the topics that a new node publishes to the topics that trigger it,
    /// through nodes that messages trigger.
    fn circle(&self, name: &str, triggers: &[usize], publishes: &[usize]) -> Option<String> {
        // Each topic to look at, with the node that led there.
        let mut ways: Vec<(usize, Option<usize>)> =
            publishes.iter().map(|topic| (*topic, None)).collect();
        // For each node that was reached, the node before it.
        let mut led: Vec<Option<Option<usize>>> = vec![None; self.nodes.len()];
        while let Some((topic, from)) = ways.pop() {
            if triggers.contains(&topic) {
                return Some(self.way(name, from, &led));
            }
            for (node, entry) in self.nodes.iter().enumerate() {
                if led[node].is_none() && entry.triggers.contains(&topic) {
                    led[node] = Some(from);
                    let its = self
                        .topics
                        .iter()
                        .enumerate()
                        .filter(|(_, known)| known.publishers.contains(&node));
                    ways.extend(its.map(|(topic, _)| (topic, Some(node))));
                }
            }
        }
        None
    }

    /// Returns the names of the nodes on the way that ends at node `last`.
    fn way(&self, name: &str, last: Option<usize>, led: &[Option<Option<usize>>]) -> String {
        let (mut names, mut next) = (vec![name], last);
        while let Some(node) = next {
            names.push(self.name(node));
            next = led[node].flatten();
        }
        names.push(name);
        names.reverse();
        names.join(" → ")
    }
}

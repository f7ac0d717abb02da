//! Checks of the topics that trigger a node.

use super::{ControlPlane, Endpoint, EndpointKind, GraphError};
use crate::release::Release;

/// Checks the triggers of a node that is added with these endpoints, and returns the
/// indices of the topics.
pub(super) fn check(
    name: &str,
    release: &Release,
    endpoints: &[Endpoint],
    graph: &ControlPlane,
) -> Result<Vec<usize>, GraphError> {
    let triggers = endpoints.iter().filter(|endpoint| endpoint.triggers);
    let triggers: Vec<usize> = triggers.map(|endpoint| endpoint.topic).collect();
    match (release, triggers.is_empty()) {
        (Release::On(_), true) => Err(GraphError::NoTrigger(name.to_owned())),
        (Release::Every(_), false) => Err(GraphError::TriggerAtRate(name.to_owned())),
        (Release::Every(_), true) => Ok(triggers),
        (Release::On(_), false) => {
            let publishes = endpoints
                .iter()
                .filter(|endpoint| matches!(endpoint.kind, EndpointKind::Publisher(_)));
            let publishes = publishes.map(|endpoint| endpoint.topic).collect();
            match graph.circle(name, &triggers, publishes) {
                Some(circle) => Err(GraphError::TriggerCycle(circle)),
                None => Ok(triggers),
            }
        }
    }
}

impl ControlPlane {
    /// The way from the topics that a new node publishes to those that trigger it, through
    /// nodes that messages trigger.
    fn circle(&self, name: &str, triggers: &[usize], publishes: Vec<usize>) -> Option<String> {
        // Each topic to look at, with the node that led there.
        let mut ways: Vec<(usize, Option<usize>)> =
            publishes.into_iter().map(|topic| (topic, None)).collect();
        let mut led: Vec<Option<(usize, Option<usize>)>> = vec![None; self.nodes.len()];
        while let Some((topic, from)) = ways.pop() {
            if triggers.contains(&topic) {
                return Some(self.way(name, from, &led));
            }
            for (node, entry) in self.nodes.iter().enumerate() {
                if led[node].is_none() && entry.topology.triggers.contains(&topic) {
                    led[node] = Some((topic, from));
                    let topics = self.topics.iter().enumerate();
                    let its = topics.filter(|(_, known)| known.publishers.contains(&node));
                    ways.extend(its.map(|(topic, _)| (topic, Some(node))));
                }
            }
        }
        None
    }

    /// The names of the nodes on the way that ends at node `last`.
    fn way(
        &self,
        name: &str,
        last: Option<usize>,
        led: &[Option<(usize, Option<usize>)>],
    ) -> String {
        let (mut names, mut next) = (vec![name], last);
        while let Some(node) = next {
            names.push(self.nodes[node].name());
            next = led[node].and_then(|(_, from)| from);
        }
        names.push(name);
        names.reverse();
        names.join(" → ")
    }
}

//! A node that is to be added to a graph, and the checks of the topics that trigger it.

use super::{ControlPlane, GraphError, topology::NodeTopology};
use crate::{node::Ends, scheduling::Member, settings::release::Release, sync::Arc};

/// A node that is to be added to a graph.
pub(super) struct NewNode<'a> {
    pub(super) name: &'a str,
    pub(super) release: Release,
    pub(super) priority: u32,
    /// Whether it runs in another process.
    pub(super) remote: bool,
}

impl<'a> NewNode<'a> {
    /// Returns a node that runs in this process.
    ///
    /// # Errors
    /// [`GraphError`] if the release is not valid.
    pub(super) fn here(
        name: &'a str,
        release: impl TryInto<Release, Error: Into<GraphError>>,
        priority: u32,
    ) -> Result<Self, GraphError> {
        Ok(Self {
            name,
            release: release.try_into().map_err(Into::into)?,
            priority,
            remote: false,
        })
    }

    /// As observers know it, with the indices of the topics that trigger it and the names of its
    /// measurements.
    pub(super) fn topology(&self, triggers: Vec<usize>, meters: Vec<String>) -> NodeTopology {
        NodeTopology {
            name: self.name.to_owned(),
            priority: self.priority,
            hz: self.release.hz(),
            triggers,
            matching: self.release.matching(),
            executor: None,
            executor_index: None,
            group: None,
            meters,
        }
    }

    /// As its scheduler knows it, with its index and the number of topics that trigger it.
    pub(super) fn member(&self, name: Arc<str>, node: usize, inputs: usize, ends: &Ends) -> Member {
        Member {
            node,
            name,
            inputs,
            priority: self.priority,
            remote: self.remote,
            records: ends.records.clone(),
            clock: ends.clock.clone(),
        }
    }
}

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

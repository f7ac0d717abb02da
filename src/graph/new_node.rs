//! A node that is to be added to a graph.

use super::{GraphError, topology::NodeTopology};
use crate::{
    node::Ends,
    scheduling::{Member, Release},
    sync::Arc,
};

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

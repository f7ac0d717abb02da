//! A node as its scheduler knows it.

use crate::{record::Records, sync::Arc, topic::Outbox};

/// A node as its scheduler knows it.
pub(crate) struct Member {
    /// Index in the graph.
    pub(crate) node: usize,
    pub(crate) name: Arc<str>,
    /// Number of the topics that trigger it.
    pub(crate) inputs: usize,
    pub(crate) priority: u32,
    /// Whether it runs in another process.
    pub(crate) remote: bool,
    pub(crate) records: Records,
    pub(crate) outbox: Arc<Outbox>,
}

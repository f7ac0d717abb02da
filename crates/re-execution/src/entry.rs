//! What a thread did, entry by entry.

use std::time::Duration;

use ratelab::{
    Time,
    journal::{Entry, Operation},
    sync::Arc,
};

/// An entry of a thread, with what follows from earlier entries.
#[derive(Debug)]
pub(crate) struct LoggedEntry {
    pub(crate) entry: Entry,
    pub(crate) operations: Arc<[Operation]>,
    /// Run time at which it began: the end of some work began with it. That of the one before for
    /// an entry without a time.
    pub(crate) began: Time,
    /// The node that did its work, if it is about some.
    pub(crate) node: Option<usize>,
}

impl LoggedEntry {
    /// Creates the entry after `last`.
    pub(crate) fn after(last: Option<&Self>, entry: Entry, operations: Vec<Operation>) -> Self {
        let (at, node) = match entry {
            Entry::Look { at, node, .. } => (Some(at), node),
            Entry::Finish { at, node } => (Some(at), Some(node)),
            Entry::Done { .. } => (None, last.and_then(|last| last.node)),
            entry => (entry.at(), None),
        };
        Self {
            entry,
            operations: operations.into(),
            began: at.or(last.map(|last| last.began)).unwrap_or_default(),
            node,
        }
    }

    /// Returns whether it began some work, which is over with the next entry.
    pub(crate) fn begins_work(&self) -> bool {
        self.node.is_some() && !matches!(self.entry, Entry::Done { .. })
    }
}

/// Returns the duration of the work that the first of these `entries` began; zero for one without
/// any.
pub(crate) fn took(entries: &[LoggedEntry]) -> Duration {
    match entries {
        [first, next, ..] if first.begins_work() => {
            next.entry.at().unwrap_or_default().since(first.began)
        }
        _ => Duration::ZERO,
    }
}

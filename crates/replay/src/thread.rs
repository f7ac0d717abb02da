//! What a thread did in a stretch.

use std::time::Duration;

use ratelab::{Entry, Operation, Time};

/// What a thread did in a stretch.
#[derive(Debug, Default)]
pub(crate) struct Thread {
    entries: Vec<(Entry, usize)>,
    operations: Vec<Operation>,
}

impl Thread {
    /// Number of entries.
    pub(crate) fn len(&self) -> usize {
        self.entries.len()
    }

    /// Entry number `index` with its operations.
    pub(crate) fn entry(&self, index: usize) -> Option<(&Entry, &[Operation])> {
        let (entry, end) = self.entries.get(index)?;
        let before = index.checked_sub(1).map_or(0, |last| self.entries[last].1);
        Some((entry, &self.operations[before..*end]))
    }

    /// Run time at which an entry began: the end of some work began with it. That of the one
    /// before for an entry without a time.
    pub(crate) fn at(&self, index: usize) -> Time {
        let entries = &self.entries[..=index.min(self.len().saturating_sub(1))];
        let begins = entries
            .iter()
            .rev()
            .filter(|(entry, _)| !matches!(entry, Entry::Done { .. }));
        let mut known = begins.filter_map(|(entry, _)| entry.at());
        known.next().unwrap_or_default()
    }

    /// The node that did the work of entry number `index`, if it is about some.
    pub(crate) fn node(&self, index: usize) -> Option<usize> {
        match self.entries.get(index)?.0 {
            Entry::Look { node, .. } => node,
            Entry::Finish { node, .. } => Some(node),
            Entry::Done { .. } => match self.entries.get(index.checked_sub(1)?)?.0 {
                Entry::Look { node, .. } => node,
                Entry::Finish { node, .. } => Some(node),
                _ => None,
            },
            _ => None,
        }
    }

    /// Whether the thread is in the midst of some work after entry number `index`.
    pub(crate) fn works_after(&self, index: usize) -> bool {
        let entry = self.entries.get(index).map(|(entry, _)| entry);
        let is_done = matches!(entry, Some(Entry::Done { .. }));
        !is_done && self.node(index).is_some()
    }

    /// Duration of the work of entry number `index`; zero for an entry without any.
    pub(crate) fn took(&self, index: usize) -> Duration {
        let began = match self.entries.get(index) {
            Some((Entry::Look { at, .. } | Entry::Finish { at, .. }, _)) => *at,
            _ => return Duration::ZERO,
        };
        match self.entries.get(index + 1) {
            Some((Entry::Done { at, .. }, _)) => at.since(began),
            _ => Duration::ZERO,
        }
    }

    /// Adds an entry with its operations.
    pub(super) fn push(&mut self, entry: Entry, operations: &[Operation]) {
        self.operations.extend_from_slice(operations);
        self.entries.push((entry, self.operations.len()));
    }
}

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

    /// Run time of an entry, or of the one before if it has none.
    pub(crate) fn at(&self, index: usize) -> Time {
        let entries = &self.entries[..=index.min(self.len().saturating_sub(1))];
        let mut known = entries.iter().rev().filter_map(|(entry, _)| entry.at());
        known.next().unwrap_or_default()
    }

    /// The node that entry number `index` of thread number `thread` is about; `None` for the one
    /// that supervises.
    pub(crate) fn node(&self, index: usize, thread: usize) -> Option<usize> {
        let entries = self.entries.get(..=index).unwrap_or_default();
        let worked = entries.iter().rev().find_map(|(entry, _)| match entry {
            Entry::Look { node, .. } => *node,
            Entry::Finish { node, .. } => Some(*node),
            _ => None,
        });
        worked.or(thread.checked_sub(1))
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

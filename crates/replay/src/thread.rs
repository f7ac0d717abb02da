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

    /// Duration of the tick that entry number `index` begins; zero for any other entry.
    pub(crate) fn took(&self, index: usize) -> Duration {
        match self.entries.get(index) {
            Some((Entry::Tick { took, .. }, _)) => *took,
            Some((Entry::Start { began }, _)) => {
                let ends = self.entries[index..]
                    .iter()
                    .filter_map(|(entry, _)| match entry {
                        Entry::Finish { ended, .. } => Some(*ended),
                        _ => None,
                    });
                ends.map(|ended| ended.since(*began))
                    .next()
                    .unwrap_or_default()
            }
            _ => Duration::ZERO,
        }
    }

    /// Adds an entry with its operations.
    pub(super) fn push(&mut self, entry: Entry, operations: &[Operation]) {
        self.operations.extend_from_slice(operations);
        self.entries.push((entry, self.operations.len()));
    }
}

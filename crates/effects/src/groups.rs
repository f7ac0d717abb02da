//! The callback groups of an executor.

use std::collections::HashMap;

use super::callback::{Callback, CallbackGroup};

/// Which callbacks exclude each other, and which of them run.
#[derive(Clone, Debug)]
pub(super) struct Groups {
    /// The mutually exclusive group of each callback.
    of: Vec<usize>,
    busy: Vec<bool>,
}

impl Groups {
    pub(super) fn new<'c>(callbacks: impl Iterator<Item = &'c Callback>) -> Self {
        let mut named = HashMap::new();
        let mut count = 0;
        let mut fresh = || {
            count += 1;
            count - 1
        };
        let of = callbacks.map(|callback| match &callback.group {
            Some(CallbackGroup::MutuallyExclusive(name)) => {
                *named.entry(name).or_insert_with(&mut fresh)
            }
            // A node ticks once at a time, in a reentrant group as well.
            Some(CallbackGroup::Reentrant) | None => fresh(),
        });
        let of: Vec<usize> = of.collect();
        Self {
            of,
            busy: vec![false; count],
        }
    }

    /// Whether no callback of this one's group runs.
    pub(super) fn is_free(&self, callback: usize) -> bool {
        !self.busy[self.of[callback]]
    }

    pub(super) fn set_busy(&mut self, callback: usize, busy: bool) {
        self.busy[self.of[callback]] = busy;
    }
}

//! Messages with equal stamps.

use std::collections::BTreeMap;

use ratelab::{TakenMessage, Time};

use super::matching::Choice;

/// Collects messages by their stamps (`exact_time.hpp:88-169`, message_filters `361e42c`).
#[derive(Clone, Debug)]
pub(crate) struct Exact {
    inputs: usize,
    /// The most stamps that wait.
    queue: usize,
    /// The messages with each stamp.
    sets: BTreeMap<Time, Vec<Option<u64>>>,
}

impl Exact {
    pub(super) fn new(inputs: usize, queue: usize) -> Self {
        Self {
            inputs,
            queue,
            sets: BTreeMap::new(),
        }
    }

    pub(super) fn add(&mut self, input: usize, taken: TakenMessage) -> Option<Choice> {
        let empty = || vec![None; self.inputs];
        let set = self.sets.entry(taken.sensed).or_insert_with(empty);
        set[input] = Some(taken.seq);
        let all: Option<Choice> = set.iter().copied().collect();
        if all.is_some() {
            // Sets with an older stamp stay incomplete.
            self.sets.retain(|stamp, _| *stamp > taken.sensed);
        }
        while self.sets.len() > self.queue {
            self.sets.pop_first();
        }
        all
    }

    pub(super) fn needs_from(&self, input: usize) -> Option<u64> {
        self.sets.values().filter_map(|set| set[input]).min()
    }
}

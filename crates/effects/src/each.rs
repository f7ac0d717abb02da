//! The newest message from each topic.

use ratelab::TakenMessage;

use super::matching::Choice;

/// Holds the newest message of each topic until all have one, and begins anew then: the
/// fusion node of the Autoware reference system (`fusion.hpp`, `de8f3bc`).
#[derive(Clone, Debug)]
pub(crate) struct Each {
    newest: Vec<Option<u64>>,
}

impl Each {
    pub(super) fn new(inputs: usize) -> Self {
        Self {
            newest: vec![None; inputs],
        }
    }

    pub(super) fn add(&mut self, input: usize, taken: TakenMessage) -> Option<Choice> {
        self.newest[input] = Some(taken.seq);
        let all: Option<Choice> = self.newest.iter().copied().collect();
        if all.is_some() {
            self.newest.fill(None);
        }
        all
    }

    /// The first message of a topic that may still be needed.
    pub(super) fn needs_from(&self, input: usize) -> Option<u64> {
        self.newest[input]
    }
}

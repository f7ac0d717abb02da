//! Who is due when, in virtual time.

use std::{cmp::Reverse, collections::BinaryHeap};

use crate::runtime::{graph::Slot, time::Time};

/// The nodes ordered by when they are due; those due together by priority,
/// then by the order in which they were added.
#[derive(Debug)]
pub(crate) struct Agenda {
    heap: BinaryHeap<Reverse<Entry>>,
    order: Vec<usize>,
}

/// When the node of this rank is due.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Entry {
    due: Time,
    rank: usize,
}

impl Agenda {
    pub(crate) fn new(slots: &[Slot]) -> Self {
        let mut order: Vec<usize> = (0..slots.len()).collect();
        order.sort_by_key(|&index| slots[index].entry.priority);
        let entries = order.iter().enumerate().map(|(rank, &index)| {
            let due = slots[index].rate.due();
            Reverse(Entry { due, rank })
        });
        Self {
            heap: entries.collect(),
            order,
        }
    }

    /// When the next node is due; never, in an empty graph.
    pub(crate) fn next_due(&self) -> Time {
        self.heap.peek().map_or(Time::MAX, |entry| entry.0.due)
    }

    /// Lets `tick` run the next node, which says when it is due again.
    pub(crate) fn run_next<R>(&mut self, tick: impl FnOnce(usize) -> (Time, R)) -> Option<R> {
        let mut next = self.heap.peek_mut()?;
        let (due, result) = tick(self.order[next.0.rank]);
        next.0.due = due;
        Some(result)
    }
}

//! The order of due ticks in virtual time.

use std::{
    cmp::Reverse,
    collections::{BinaryHeap, HashMap, hash_map},
};

use crate::runtime::{scheduled_node::ScheduledNode, time::Time};

/// The nodes with a rate and a thread of their own, ordered by due time, then by priority,
/// then by the order of their addition.
///
/// Nodes with the same rate stay due together, so they are ordered once, and only their
/// cohorts are reordered on each tick. A thousand nodes mostly share a handful of rates. All
/// other events are in the [`Dispatcher`](crate::runtime::dispatch::Dispatcher).
#[derive(Debug)]
pub(crate) struct DueQueue {
    heap: BinaryHeap<Reverse<NextDue>>,
    cohorts: Vec<Cohort>,
}

/// When the next node of this cohort is due, and its rank.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct NextDue {
    due: Time,
    rank: usize,
    cohort: usize,
}

/// Nodes with the same rate.
#[derive(Debug, Default)]
struct Cohort {
    members: Vec<Member>,
    /// Number of members that have ticked in the current instant.
    done: usize,
}

/// A node with its rank and its index in the graph.
#[derive(Clone, Copy, Debug)]
struct Member {
    rank: usize,
    index: usize,
}

impl DueQueue {
    pub(crate) fn new(nodes: &[ScheduledNode]) -> Self {
        let mut queue = Self {
            heap: BinaryHeap::new(),
            cohorts: Vec::new(),
        };
        let mut order: Vec<usize> = (0..nodes.len()).collect();
        order.sort_by_key(|&index| nodes[index].entry.priority);
        let mut known = HashMap::new();
        for (rank, index) in order.into_iter().enumerate() {
            if nodes[index].is_crashed() || !nodes[index].skips_ticks() {
                continue;
            }
            let rate = &nodes[index].rate;
            let cohort = match known.entry(rate) {
                hash_map::Entry::Occupied(known) => *known.get(),
                hash_map::Entry::Vacant(new) => *new.insert(queue.found(rate.due(), rank)),
            };
            queue.cohorts[cohort].members.push(Member { rank, index });
        }
        queue
    }

    /// Adds a cohort whose first member has this rank.
    fn found(&mut self, due: Time, rank: usize) -> usize {
        let cohort = self.cohorts.len();
        self.cohorts.push(Cohort::default());
        self.heap.push(Reverse(NextDue { due, rank, cohort }));
        cohort
    }

    /// Run time of the next due tick; [`Time::MAX`] without nodes.
    pub(crate) fn next_at(&self) -> Time {
        self.heap.peek().map_or(Time::MAX, |entry| entry.0.due)
    }

    /// Index of the node that is due next.
    pub(crate) fn next(&self) -> Option<usize> {
        let Reverse(next) = self.heap.peek()?;
        let cohort = &self.cohorts[next.cohort];
        Some(cohort.members[cohort.done].index)
    }

    /// Moves the node that just ticked on to its next tick, at `due`.
    pub(crate) fn ticked(&mut self, due: Time) {
        if let Some(mut next) = self.heap.peek_mut() {
            let Reverse(next) = &mut *next;
            let cohort = &mut self.cohorts[next.cohort];
            cohort.done += 1;
            if cohort.done == cohort.members.len() {
                cohort.done = 0;
                next.due = due;
            }
            next.rank = cohort.members[cohort.done].rank;
        }
    }
}

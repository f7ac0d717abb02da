//! Who is due when, in virtual time.

use std::{
    cmp::Reverse,
    collections::{BinaryHeap, HashMap, hash_map},
};

use crate::runtime::{scheduled_node::ScheduledNode, time::Time};

/// The nodes ordered by when they are due; those due together by priority,
/// then by the order in which they were added.
///
/// Nodes whose rates are the same are due together for ever, so they are
/// ordered once, and only their cohorts are ordered again and again. A thousand
/// nodes mostly share a handful of rates.
#[derive(Debug)]
pub(crate) struct EventQueue {
    heap: BinaryHeap<Reverse<Entry>>,
    cohorts: Vec<Cohort>,
}

/// When the next node of this cohort is due, and the rank of that node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Entry {
    due: Time,
    rank: usize,
    cohort: usize,
}

/// Nodes with the same rate.
#[derive(Debug, Default)]
struct Cohort {
    members: Vec<Member>,
    /// How many of them have ticked in the instant that is due.
    done: usize,
}

/// A node by its rank among all and by its place in the graph.
#[derive(Clone, Copy, Debug)]
struct Member {
    rank: usize,
    index: usize,
}

impl EventQueue {
    pub(crate) fn new(nodes: &[ScheduledNode]) -> Self {
        let mut queue = Self {
            heap: BinaryHeap::new(),
            cohorts: Vec::new(),
        };
        let mut order: Vec<usize> = (0..nodes.len()).collect();
        order.sort_by_key(|&index| nodes[index].entry.priority);
        let mut known = HashMap::new();
        for (rank, index) in order.into_iter().enumerate() {
            let rate = &nodes[index].rate;
            let cohort = match known.entry(rate) {
                hash_map::Entry::Occupied(known) => *known.get(),
                hash_map::Entry::Vacant(new) => *new.insert(queue.found(rate.due(), rank)),
            };
            queue.cohorts[cohort].members.push(Member { rank, index });
        }
        queue
    }

    /// Founds a cohort whose first member has this rank.
    fn found(&mut self, due: Time, rank: usize) -> usize {
        let cohort = self.cohorts.len();
        self.cohorts.push(Cohort::default());
        self.heap.push(Reverse(Entry { due, rank, cohort }));
        cohort
    }

    /// When the next node is due; never, in an empty graph.
    pub(crate) fn next_due(&self) -> Time {
        self.heap.peek().map_or(Time::MAX, |entry| entry.0.due)
    }

    /// Which node is next, and when it is due; none, in an empty graph.
    pub(crate) fn next(&self) -> Option<(Time, usize)> {
        let Reverse(next) = self.heap.peek()?;
        let cohort = &self.cohorts[next.cohort];
        Some((next.due, cohort.members[cohort.done].index))
    }

    /// The next node has ticked and is due again at `due`.
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

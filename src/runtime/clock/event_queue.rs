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
///
/// Ticks that are late, and ticks that take time, are few; they wait in a queue of
/// their own.
#[derive(Debug)]
pub(crate) struct EventQueue {
    heap: BinaryHeap<Reverse<Entry>>,
    cohorts: Vec<Cohort>,
    pending: BinaryHeap<Reverse<Pending>>,
    /// The rank of each node by its place in the graph.
    ranks: Vec<usize>,
}

/// What happens to a node next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct NodeEvent {
    pub(crate) at: Time,
    /// Its place in the graph.
    pub(crate) node: usize,
    pub(crate) kind: NodeEventKind,
}

/// The order of these is that within an instant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum NodeEventKind {
    /// A tick that takes time is over.
    Ends,
    /// A tick that is late starts.
    Starts,
    /// A tick is due.
    Due,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Pending {
    at: Time,
    kind: NodeEventKind,
    rank: usize,
    index: usize,
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
            pending: BinaryHeap::new(),
            ranks: vec![0; nodes.len()],
        };
        let mut order: Vec<usize> = (0..nodes.len()).collect();
        order.sort_by_key(|&index| nodes[index].entry.priority);
        let mut known = HashMap::new();
        for (rank, index) in order.into_iter().enumerate() {
            queue.ranks[index] = rank;
            if nodes[index].is_crashed() {
                continue;
            }
            let rate = &nodes[index].rate;
            let cohort = match known.entry(rate) {
                hash_map::Entry::Occupied(known) => *known.get(),
                hash_map::Entry::Vacant(new) => *new.insert(queue.found(rate.due(), rank)),
            };
            queue.cohorts[cohort].members.push(Member { rank, index });
        }
        for (index, node) in nodes.iter().enumerate() {
            queue.add_pending(index, node);
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

    fn add_pending(&mut self, index: usize, node: &ScheduledNode) {
        let Some(timing) = &node.timing else { return };
        if let Some(waiting) = timing.waiting {
            self.add(index, waiting.starts, NodeEventKind::Starts);
        }
        if let Some(running) = &timing.running {
            self.add(index, running.ends, NodeEventKind::Ends);
        }
    }

    /// Something is going to happen at `at` to the node with place `index`.
    pub(crate) fn add(&mut self, index: usize, at: Time, kind: NodeEventKind) {
        let rank = self.ranks[index];
        self.pending.push(Reverse(Pending {
            at,
            kind,
            rank,
            index,
        }));
    }

    /// When something happens next; never, in an empty graph.
    pub(crate) fn next_at(&self) -> Time {
        let due = self.heap.peek().map_or(Time::MAX, |entry| entry.0.due);
        let pending = self.pending.peek();
        pending.map_or(due, |pending| due.min(pending.0.at))
    }

    /// What happens next; nothing, in an empty graph.
    pub(crate) fn next(&self) -> Option<NodeEvent> {
        let due = self.heap.peek().map(|Reverse(due)| due);
        if let Some(Reverse(pending)) = self.pending.peek()
            && due.is_none_or(|due| pending.comes_before(due))
        {
            return Some(NodeEvent {
                at: pending.at,
                node: pending.index,
                kind: pending.kind,
            });
        }
        let due = due?;
        let cohort = &self.cohorts[due.cohort];
        Some(NodeEvent {
            at: due.due,
            node: cohort.members[cohort.done].index,
            kind: NodeEventKind::Due,
        })
    }

    /// The next event, which was no tick that is due, has happened.
    pub(crate) fn happened(&mut self) {
        self.pending.pop();
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

impl Pending {
    /// Whether it comes before a tick that is due. A tick that is late comes after
    /// one of the same node that is due at its start: that one is passed over.
    fn comes_before(&self, due: &Entry) -> bool {
        match self.kind {
            NodeEventKind::Ends => self.at <= due.due,
            _ => (self.at, self.rank) < (due.due, due.rank),
        }
    }
}

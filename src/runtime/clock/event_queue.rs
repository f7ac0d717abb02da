//! The order of node events in virtual time.

use std::{
    cmp::Reverse,
    collections::{BinaryHeap, HashMap, hash_map},
};

use crate::runtime::{scheduled_node::ScheduledNode, time::Time};

/// The nodes ordered by due time, then by priority, then by the order of their addition.
///
/// Nodes with the same rate stay due together, so they are ordered once, and only their
/// cohorts are reordered on each tick. A thousand nodes mostly share a handful of rates.
///
/// Late ticks and ticks that take time are rare; they wait in a separate queue. Triggered
/// nodes and those of executors are not here, but with the
/// [`Dispatcher`](crate::runtime::executor::Dispatcher).
#[derive(Debug)]
pub(crate) struct EventQueue {
    heap: BinaryHeap<Reverse<NextDue>>,
    cohorts: Vec<Cohort>,
    pending: BinaryHeap<Reverse<Pending>>,
    /// Rank of each node, by its index in the graph.
    ranks: Vec<usize>,
}

/// The next event of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct NodeEvent {
    pub(crate) at: Time,
    /// Index of the node in the graph.
    pub(crate) node: usize,
    pub(crate) kind: NodeEventKind,
}

/// The variants are in the order of events within an instant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum NodeEventKind {
    /// A tick that takes time ends.
    Ends,
    /// A late tick starts.
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
        let nodes = nodes.iter().enumerate();
        for (index, node) in nodes.filter(|(_, node)| node.skips_ticks()) {
            queue.add_pending(index, node);
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

    fn add_pending(&mut self, index: usize, node: &ScheduledNode) {
        let Some(timing) = &node.timing else { return };
        if let Some(waiting) = timing.waiting {
            self.add(index, waiting.starts, NodeEventKind::Starts);
        }
        if let Some(running) = &timing.running {
            self.add(index, running.ends, NodeEventKind::Ends);
        }
    }

    /// Adds an event at `at` of the node with index `index`.
    pub(crate) fn add(&mut self, index: usize, at: Time, kind: NodeEventKind) {
        let rank = self.ranks[index];
        self.pending.push(Reverse(Pending {
            at,
            kind,
            rank,
            index,
        }));
    }

    /// Time of the next event; [`Time::MAX`] for an empty graph.
    pub(crate) fn next_at(&self) -> Time {
        let due = self.heap.peek().map_or(Time::MAX, |entry| entry.0.due);
        let pending = self.pending.peek();
        pending.map_or(due, |pending| due.min(pending.0.at))
    }

    /// The next event; `None` for an empty graph.
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

    /// Removes the next event, which was not a due tick.
    pub(crate) fn happened(&mut self) {
        self.pending.pop();
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

impl Pending {
    /// Whether it comes before a due tick. A late tick comes after a tick of the same
    /// node that is due at its start: that due tick is skipped.
    fn comes_before(&self, due: &NextDue) -> bool {
        match self.kind {
            NodeEventKind::Ends => self.at <= due.due,
            _ => (self.at, self.rank) < (due.due, due.rank),
        }
    }
}

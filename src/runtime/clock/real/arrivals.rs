//! Messages for the nodes that they trigger, under the real clock.

use std::{cmp::Reverse, collections::BinaryHeap};

use super::mailbox::{Mailbox, Wakeup};
use crate::runtime::{
    graph::Graph,
    sync::Arc,
    time::Time,
    trigger::{Arrival, Wake},
};

/// The messages that may complete the inputs of a node's next tick.
pub(super) struct Inbound {
    /// Those that arrive later, because of the link of their topic.
    later: BinaryHeap<Reverse<(Time, usize, usize)>>,
    /// How many may wait in the queues.
    here: u64,
}

impl Inbound {
    /// Any number may wait already.
    pub(super) fn new() -> Self {
        Self {
            later: BinaryHeap::new(),
            here: u64::MAX,
        }
    }

    /// A node that is busy for long or crashed gets many: those that are here are counted only.
    pub(super) fn add(&mut self, Arrival { at, node, input }: Arrival, now: Time) {
        match at <= now {
            true => self.here = self.here.saturating_add(1),
            false => self.later.push(Reverse((at, node, input))),
        }
    }

    /// Has those arrive that are due at `now`.
    pub(super) fn pass(&mut self, now: Time) {
        while self
            .later
            .peek()
            .is_some_and(|Reverse((at, ..))| *at <= now)
        {
            self.later.pop();
            self.here = self.here.saturating_add(1);
        }
    }

    /// Time of the next look at the queues.
    pub(super) fn next_at(&self) -> Time {
        match self.later.peek() {
            _ if self.here > 0 => Time::ZERO,
            Some(Reverse((at, ..))) => *at,
            None => Time::MAX,
        }
    }

    /// A tick had its inputs.
    pub(super) fn took_one(&mut self) {
        self.here = self.here.saturating_sub(1);
    }

    /// Nothing is left that makes the inputs of a tick.
    pub(super) fn found_none(&mut self) {
        self.here = 0;
    }

    /// Any number may wait.
    pub(super) fn look_at_all(&mut self) {
        self.here = u64::MAX;
    }
}

/// Posts arrivals to the threads of the nodes.
struct Post(Vec<Option<Arc<Mailbox>>>);

impl Wake for Post {
    fn wake(&self, arrival: Arrival) {
        if let Some(Some(mailbox)) = self.0.get(arrival.node) {
            mailbox.post(Wakeup::Arrival(arrival));
        }
    }
}

/// Has the nodes of this process get their messages through their mailboxes.
pub(super) fn begin_arrivals(graph: &mut Graph, mailboxes: &[Arc<Mailbox>]) {
    let nodes = graph.nodes.iter().zip(mailboxes);
    let here = nodes.map(|(node, mailbox)| (!node.entry.remote).then(|| mailbox.clone()));
    let post = Post(here.collect());
    for arrival in graph.control.arrivals_after(graph.now()) {
        post.wake(arrival);
    }
    graph.dispatcher.leave(Arc::new(post));
}

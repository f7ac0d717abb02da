//! Wakes the threads of the real clock before their deadlines.

use std::collections::VecDeque;

use crate::{
    clock::wall::Wall,
    command::Command,
    graph::Graph,
    scheduling::Threads,
    sync::{Arc, Condvar, Instant, Mutex, lock},
    time::Time,
    trigger::{Arrival, Wake},
};

/// A reason to wake a node's thread.
#[derive(Debug)]
pub(super) enum Wakeup {
    /// Start: the relation of run time to wall time.
    Start(Wall),
    /// Carry out this command for the node with this index, and log it.
    Command(usize, Command),
    /// A message arrives that triggers the node.
    Arrival(Arrival),
    /// Stop: run time has stopped here.
    Stop(Time),
}

/// A queue of wake-ups with waits up to a deadline. Threads take what is there, and wait for the
/// number of posts to change: a wake-up ends the wait at once.
#[derive(Debug, Default)]
pub(super) struct Mailbox {
    queue: Mutex<Wakeups>,
    wake: Condvar,
}

#[derive(Debug, Default)]
struct Wakeups {
    wakeups: VecDeque<Wakeup>,
    /// Number of posts and rings so far.
    posts: u64,
}

impl Mailbox {
    /// Adds a wake-up and wakes all waiting threads.
    pub(super) fn post(&self, wakeup: Wakeup) {
        let mut queue = lock(&self.queue);
        queue.wakeups.push_back(wakeup);
        queue.posts += 1;
        drop(queue);
        self.wake.notify_all();
    }

    /// Wakes all waiting threads.
    pub(super) fn ring(&self) {
        lock(&self.queue).posts += 1;
        self.wake.notify_all();
    }

    /// Number of posts and rings so far.
    pub(super) fn posts(&self) -> u64 {
        lock(&self.queue).posts
    }

    /// Removes all wake-ups.
    pub(super) fn take_all(&self) -> VecDeque<Wakeup> {
        std::mem::take(&mut lock(&self.queue).wakeups)
    }

    /// Waits for more than the posts that were `seen`.
    pub(super) fn wait_past(&self, seen: u64) {
        let mut queue = lock(&self.queue);
        while queue.posts == seen {
            let woken = self.wake.wait(queue);
            queue = woken.unwrap_or_else(|poisoned| poisoned.into_inner());
        }
    }

    /// The same, until run time `time` at most.
    pub(super) fn wait_past_until(&self, seen: u64, wall: &Wall, time: Time) {
        let deadline = wall.instant_of(time);
        let mut queue = lock(&self.queue);
        while queue.posts == seen {
            let remaining = deadline.saturating_duration_since(Instant::now());
            if remaining.is_zero() {
                return;
            }
            queue = self.park(queue, remaining);
        }
    }

    /// The same, but keeps a core busy while waiting; no longer than until it is `over`.
    pub(super) fn spin_past_until(
        &self,
        seen: u64,
        wall: &Wall,
        time: Time,
        over: impl Fn() -> bool,
    ) {
        let deadline = wall.instant_of(time);
        while lock(&self.queue).posts == seen && !over() && Instant::now() < deadline {
            spin();
        }
    }

    /// The run time of a requested stop; `None` without such a request.
    pub(super) fn stop_requested(&self) -> Option<Time> {
        lock(&self.queue)
            .wakeups
            .iter()
            .find_map(|wakeup| match wakeup {
                Wakeup::Stop(at) => Some(*at),
                _ => None,
            })
    }

    #[cfg(not(feature = "model"))]
    fn park<'q>(&'q self, queue: QueueGuard<'q>, remaining: std::time::Duration) -> QueueGuard<'q> {
        match self.wake.wait_timeout(queue, remaining) {
            Ok((queue, _)) => queue,
            Err(poisoned) => poisoned.into_inner().0,
        }
    }

    /// The model's condition variables have no time-out, but its wall clock advances with
    /// every read: only a long wait is one.
    #[cfg(feature = "model")]
    fn park<'q>(&'q self, queue: QueueGuard<'q>, remaining: std::time::Duration) -> QueueGuard<'q> {
        if remaining > std::time::Duration::from_secs(3600) {
            return self.wake.wait(queue).expect("no panic");
        }
        drop(queue);
        crate::sync::thread::yield_now();
        lock(&self.queue)
    }
}

/// The mailbox of each node's thread; the nodes of an executor have one in common.
pub(super) fn mailboxes(graph: &Graph) -> Vec<Arc<Mailbox>> {
    let nodes = graph.seats.iter();
    let mut mailboxes: Vec<Arc<Mailbox>> = nodes.map(|_| Arc::default()).collect();
    for crew in graph.stage.crews() {
        let dispatch = crew.dispatch.as_ref();
        if dispatch.is_some_and(|d| matches!(d.threads(), Threads::Shared(_))) {
            let common = Arc::<Mailbox>::default();
            for member in &crew.members {
                mailboxes[member.node] = common.clone();
            }
        }
    }
    mailboxes
}

/// Posts arrivals to the threads of the nodes.
pub(super) struct Post(Vec<Option<Arc<Mailbox>>>);

impl Post {
    /// The way to the mailboxes of the nodes that run here.
    pub(super) fn new(graph: &Graph, mailboxes: &[Arc<Mailbox>]) -> Self {
        let nodes = mailboxes.iter().enumerate();
        let here = nodes.map(|(node, mailbox)| graph.is_here(node).then(|| mailbox.clone()));
        Self(here.collect())
    }
}

impl Wake for Post {
    fn wake(&self, arrival: Arrival) {
        if let Some(Some(mailbox)) = self.0.get(arrival.node) {
            mailbox.post(Wakeup::Arrival(arrival));
        }
    }
}

type QueueGuard<'q> = crate::sync::MutexGuard<'q, Wakeups>;

/// Keeps a core busy for about a microsecond.
#[cfg(not(feature = "model"))]
fn spin() {
    (0..64).for_each(|_| std::hint::spin_loop());
}

#[cfg(feature = "model")]
fn spin() {
    crate::sync::thread::yield_now();
}

//! Wakes the threads of the real clock before their deadlines.

use std::time::Duration;

use crate::{
    clock::wall::Wall,
    command::Command,
    graph::Graph,
    scheduling::Threads,
    sync::{Arc, Condvar, Instant, Mutex, MutexGuard, lock},
    time::Time,
    trigger::{Arrival, Wake},
};

/// What reaches the threads of a crew from outside. They wait for the number of posts to change:
/// each one ends a wait at once. Its lock is the last that anybody takes.
#[derive(Debug, Default)]
pub(super) struct Mailbox {
    mail: Mutex<Mail>,
    bell: Condvar,
}

/// What is there.
#[derive(Debug, Default)]
pub(super) struct Mail {
    /// The relation of run time to wall time, from the start on.
    pub(super) wall: Option<Wall>,
    /// The run time at which the threads are to stop.
    pub(super) stopped: Option<Time>,
    /// Messages that no thread has heard of.
    pub(super) arrivals: Vec<Arrival>,
    /// Commands for nodes, by their indices.
    pub(super) commands: Vec<(usize, Command)>,
    /// Number of posts so far.
    posts: u64,
}

impl Mailbox {
    /// Adds some mail and wakes all waiting threads.
    pub(super) fn post(&self, add: impl FnOnce(&mut Mail)) {
        let mut mail = self.open();
        add(&mut mail);
        mail.posts += 1;
        drop(mail);
        self.bell.notify_all();
    }

    /// The mail, for a look.
    pub(super) fn open(&self) -> MutexGuard<'_, Mail> {
        lock(&self.mail)
    }

    /// Number of posts so far.
    pub(super) fn posts(&self) -> u64 {
        self.open().posts
    }

    /// Waits for more than the posts that were `seen`.
    pub(super) fn wait_past(&self, seen: u64) {
        let mut mail = self.open();
        while mail.posts == seen {
            let woken = self.bell.wait(mail);
            mail = woken.unwrap_or_else(|poisoned| poisoned.into_inner());
        }
    }

    /// The same, until run time `time` at most.
    pub(super) fn wait_past_until(&self, seen: u64, wall: &Wall, time: Time) {
        let deadline = wall.instant_of(time);
        let mut mail = self.open();
        while mail.posts == seen {
            let remaining = deadline.saturating_duration_since(Instant::now());
            if remaining.is_zero() {
                return;
            }
            mail = self.park(mail, remaining);
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
        while self.open().posts == seen && !over() && Instant::now() < deadline {
            spin();
        }
    }

    #[cfg(not(feature = "model"))]
    fn park<'m>(&'m self, mail: MutexGuard<'m, Mail>, remaining: Duration) -> MutexGuard<'m, Mail> {
        match self.bell.wait_timeout(mail, remaining) {
            Ok((mail, _)) => mail,
            Err(poisoned) => poisoned.into_inner().0,
        }
    }

    /// The model's condition variables have no time-out, but its wall clock advances with
    /// every read: only a long wait is one.
    #[cfg(feature = "model")]
    fn park<'m>(&'m self, mail: MutexGuard<'m, Mail>, remaining: Duration) -> MutexGuard<'m, Mail> {
        if remaining > Duration::from_secs(3600) {
            return self.bell.wait(mail).expect("no panic");
        }
        drop(mail);
        crate::sync::thread::yield_now();
        self.open()
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
            mailbox.post(|mail| mail.arrivals.push(arrival));
        }
    }
}

/// Keeps a core busy for about a microsecond.
#[cfg(not(feature = "model"))]
fn spin() {
    (0..64).for_each(|_| std::hint::spin_loop());
}

#[cfg(feature = "model")]
fn spin() {
    crate::sync::thread::yield_now();
}

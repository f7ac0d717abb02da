//! Wakes the threads of the real clock before their deadlines.

use ratelab::{
    Command, Time,
    clock::{Arrival, ThreadGroup, Wake, Wall},
    sync::{Arc, Condvar, Instant, Mutex, MutexGuard, lock, spin, wait_timeout},
};

/// What reaches the threads of a task set from outside. They wait for the number of posts to
/// change: each one ends a wait at once. Its lock is the last that anybody takes.
#[derive(Debug, Default)]
pub(crate) struct Mailbox {
    mail: Mutex<Mail>,
    bell: Condvar,
}

/// What is there.
#[derive(Debug, Default)]
pub(crate) struct Mail {
    /// The relation of run time to wall time, from the start on.
    pub(crate) wall: Option<Wall>,
    /// The run time at which the threads are to stop.
    pub(crate) stopped: Option<Time>,
    /// Messages that no thread has heard of.
    pub(crate) arrivals: Vec<Arrival>,
    /// Commands for nodes, by their indices.
    pub(crate) commands: Vec<(usize, Command)>,
    /// Number of posts so far.
    posts: u64,
}

impl Mailbox {
    /// Adds some mail and wakes all waiting threads.
    pub(crate) fn post(&self, add: impl FnOnce(&mut Mail)) {
        let mut mail = self.open();
        add(&mut mail);
        mail.posts += 1;
        drop(mail);
        self.bell.notify_all();
    }

    /// Returns the mail, locked.
    pub(crate) fn open(&self) -> MutexGuard<'_, Mail> {
        lock(&self.mail)
    }

    /// Returns the number of posts so far.
    pub(crate) fn posts(&self) -> u64 {
        self.open().posts
    }

    /// Waits for the start; `None` for a stop.
    pub(crate) fn wait_for_start(&self) -> Option<Wall> {
        let mut mail = self.open();
        while mail.wall.is_none() && mail.stopped.is_none() {
            let woken = self.bell.wait(mail);
            mail = woken.unwrap_or_else(|poisoned| poisoned.into_inner());
        }
        // Commands may have come before a stop: they take effect.
        mail.wall
    }

    /// Waits until there are more posts than `seen`, until run time `time` at most.
    pub(crate) fn wait_past_until(&self, seen: u64, wall: &Wall, time: Time) {
        let deadline = wall.instant_of(time);
        let mut mail = self.open();
        while mail.posts == seen {
            let remaining = deadline.saturating_duration_since(Instant::now());
            if remaining.is_zero() {
                return;
            }
            mail = wait_timeout(&self.bell, &self.mail, mail, remaining);
        }
    }

    /// Waits for that with a core kept busy; also ends when it is `over`.
    pub(crate) fn spin_past_until(
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
}

/// The mailboxes of a stretch.
pub(crate) struct Post {
    all: Vec<Arc<Mailbox>>,
    /// The mailbox for each node that runs here, by its index.
    of: Vec<Option<Arc<Mailbox>>>,
}

impl Post {
    /// Creates the mailboxes of threads, for some of so many `nodes`.
    pub(crate) fn new<'g>(
        nodes: usize,
        groups: impl Iterator<Item = (&'g ThreadGroup<'g>, &'g Arc<Mailbox>)>,
    ) -> Self {
        let (mut all, mut of) = (Vec::new(), vec![None; nodes]);
        for (group, mailbox) in groups {
            all.push(mailbox.clone());
            for node in &group.nodes {
                of[*node] = Some(mailbox.clone());
            }
        }
        Self { all, of }
    }

    /// Adds some mail to all of them.
    pub(crate) fn to_all(&self, add: impl Fn(&mut Mail)) {
        self.all.iter().for_each(|mailbox| mailbox.post(&add));
    }

    /// Adds some mail for a node, if it runs here.
    pub(crate) fn to(&self, node: usize, add: impl FnOnce(&mut Mail)) {
        if let Some(Some(mailbox)) = self.of.get(node) {
            mailbox.post(add);
        }
    }
}

impl Wake for Post {
    fn wake(&self, arrival: Arrival) {
        self.to(arrival.node, |mail| mail.arrivals.push(arrival));
    }
}

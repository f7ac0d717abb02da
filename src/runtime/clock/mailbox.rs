//! How the real clock reaches a node that is waiting for its deadline.

use std::collections::VecDeque;

use super::wall::Wall;
use crate::runtime::{
    command::Command,
    sync::{Condvar, Instant, Mutex, lock},
    time::Time,
};

/// What a node's thread is told.
#[derive(Debug)]
pub(crate) enum Mail {
    /// Run time is tied to wall time like this: begin.
    Begin(Wall),
    /// Obey this command, which is for the node, and log that.
    Obey(Command),
    /// Come home: run time has stopped here.
    Leave(Time),
}

/// A queue of mail that can be waited on with a deadline: mail ends the wait
/// at once.
#[derive(Debug, Default)]
pub(crate) struct Mailbox {
    mail: Mutex<VecDeque<Mail>>,
    bell: Condvar,
}

impl Mailbox {
    /// Puts mail in and wakes whoever waits for it.
    pub(crate) fn post(&self, mail: Mail) {
        lock(&self.mail).push_back(mail);
        self.bell.notify_one();
    }

    /// When run time stopped, if the call to come home is among the mail.
    pub(crate) fn called_home(&self) -> Option<Time> {
        lock(&self.mail).iter().find_map(|mail| match mail {
            Mail::Leave(at) => Some(*at),
            _ => None,
        })
    }

    /// The next mail, however long it takes.
    pub(crate) fn wait(&self) -> Mail {
        let mut queue = lock(&self.mail);
        loop {
            if let Some(mail) = queue.pop_front() {
                return mail;
            }
            queue = self
                .bell
                .wait(queue)
                .unwrap_or_else(|poisoned| poisoned.into_inner());
        }
    }

    /// The next mail, or `None` once run time `time` has come.
    pub(crate) fn wait_until(&self, wall: &Wall, time: Time) -> Option<Mail> {
        let deadline = wall.instant_of(time);
        let mut queue = lock(&self.mail);
        loop {
            if let Some(mail) = queue.pop_front() {
                return Some(mail);
            }
            let remaining = deadline.saturating_duration_since(Instant::now());
            if remaining.is_zero() {
                return None;
            }
            queue = self.doze(queue, remaining);
        }
    }

    #[cfg(not(feature = "model"))]
    fn doze<'q>(&'q self, queue: Queue<'q>, remaining: std::time::Duration) -> Queue<'q> {
        match self.bell.wait_timeout(queue, remaining) {
            Ok((queue, _)) => queue,
            Err(poisoned) => poisoned.into_inner().0,
        }
    }

    /// The model's condition variables know no time-out, but its wall clock
    /// advances with every look.
    #[cfg(feature = "model")]
    fn doze<'q>(&'q self, queue: Queue<'q>, _: std::time::Duration) -> Queue<'q> {
        drop(queue);
        crate::runtime::sync::thread::yield_now();
        lock(&self.mail)
    }
}

type Queue<'q> = crate::runtime::sync::MutexGuard<'q, VecDeque<Mail>>;

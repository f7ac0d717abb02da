//! Wakes a node thread of the real clock before its deadline.

use std::collections::VecDeque;

use super::wall::Wall;
use crate::runtime::{
    command::Command,
    sync::{Condvar, Instant, Mutex, lock},
    time::Time,
    trigger::Arrival,
};

/// A reason to wake a node's thread.
#[derive(Debug)]
pub(crate) enum Wakeup {
    /// Start: the relation of run time to wall time.
    Start(Wall),
    /// Carry out this command for the node, and log it.
    Command(Command),
    /// A message arrives that triggers the node.
    Arrival(Arrival),
    /// Stop: run time has stopped here.
    Stop(Time),
}

/// A queue of wake-ups with waits up to a deadline: a wake-up ends the wait at once.
#[derive(Debug, Default)]
pub(crate) struct Mailbox {
    queue: Mutex<VecDeque<Wakeup>>,
    wake: Condvar,
}

impl Mailbox {
    /// Adds a wake-up and wakes the waiting thread.
    pub(crate) fn post(&self, wakeup: Wakeup) {
        lock(&self.queue).push_back(wakeup);
        self.wake.notify_one();
    }

    /// The run time of a requested stop; `None` without such a request.
    pub(crate) fn stop_requested(&self) -> Option<Time> {
        lock(&self.queue).iter().find_map(|wakeup| match wakeup {
            Wakeup::Stop(at) => Some(*at),
            _ => None,
        })
    }

    /// The next wake-up, if there is one.
    pub(crate) fn take(&self) -> Option<Wakeup> {
        lock(&self.queue).pop_front()
    }

    /// Waits for the next wake-up without a deadline.
    pub(crate) fn wait(&self) -> Wakeup {
        let mut queue = lock(&self.queue);
        loop {
            if let Some(wakeup) = queue.pop_front() {
                return wakeup;
            }
            queue = self
                .wake
                .wait(queue)
                .unwrap_or_else(|poisoned| poisoned.into_inner());
        }
    }

    /// Waits for the next wake-up; `None` at run time `time`.
    pub(crate) fn wait_until(&self, wall: &Wall, time: Time) -> Option<Wakeup> {
        let deadline = wall.instant_of(time);
        let mut queue = lock(&self.queue);
        loop {
            if let Some(wakeup) = queue.pop_front() {
                return Some(wakeup);
            }
            let remaining = deadline.saturating_duration_since(Instant::now());
            if remaining.is_zero() {
                return None;
            }
            queue = self.park(queue, remaining);
        }
    }

    /// Like [`wait_until`](Self::wait_until), but keeps a core busy while waiting.
    pub(crate) fn spin_until(&self, wall: &Wall, time: Time) -> Option<Wakeup> {
        let deadline = wall.instant_of(time);
        loop {
            if let Some(wakeup) = lock(&self.queue).pop_front() {
                return Some(wakeup);
            }
            if Instant::now() >= deadline {
                return None;
            }
            spin();
        }
    }

    #[cfg(not(feature = "model"))]
    fn park<'q>(
        &'q self,
        queue: WakeupQueue<'q>,
        remaining: std::time::Duration,
    ) -> WakeupQueue<'q> {
        match self.wake.wait_timeout(queue, remaining) {
            Ok((queue, _)) => queue,
            Err(poisoned) => poisoned.into_inner().0,
        }
    }

    /// The model's condition variables have no time-out, but its wall clock advances with
    /// every read.
    #[cfg(feature = "model")]
    fn park<'q>(&'q self, queue: WakeupQueue<'q>, _: std::time::Duration) -> WakeupQueue<'q> {
        drop(queue);
        crate::runtime::sync::thread::yield_now();
        lock(&self.queue)
    }
}

type WakeupQueue<'q> = crate::runtime::sync::MutexGuard<'q, VecDeque<Wakeup>>;

/// Keeps a core busy for about a microsecond.
#[cfg(not(feature = "model"))]
fn spin() {
    (0..64).for_each(|_| std::hint::spin_loop());
}

#[cfg(feature = "model")]
fn spin() {
    crate::runtime::sync::thread::yield_now();
}

//! What a tick publishes, held back until the tick is over.

use std::fmt;

use super::{
    sync::{
        Mutex,
        atomic::{AtomicBool, Ordering},
        lock,
    },
    time::Time,
};

/// Publishes one message at the given run time.
type Held = Box<dyn FnOnce(Time) + Send>;

/// Where all publishers of a node put their messages while the node is in a tick
/// that takes time.
#[derive(Default)]
pub(crate) struct Outbox {
    holds: AtomicBool,
    held: Mutex<Vec<Held>>,
}

impl Outbox {
    /// Whether messages are to be put in here.
    pub(crate) fn holds(&self) -> bool {
        self.holds.load(Ordering::Relaxed)
    }

    /// Begins or ceases to hold messages back.
    pub(crate) fn hold(&self, on: bool) {
        self.holds.store(on, Ordering::Relaxed);
    }

    /// Puts a message in.
    pub(crate) fn put(&self, message: Held) {
        lock(&self.held).push(message);
    }

    /// Publishes all that is in here at run time `now`, in order.
    pub(crate) fn release(&self, now: Time) {
        let held = std::mem::take(&mut *lock(&self.held));
        held.into_iter().for_each(|message| message(now));
    }
}

impl fmt::Debug for Outbox {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Outbox").finish_non_exhaustive()
    }
}

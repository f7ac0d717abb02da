//! The clock by which a node stamps its messages.

use crate::{
    settings::local_clock::LocalClock,
    sync::{
        Mutex,
        atomic::{AtomicBool, Ordering},
        lock,
    },
    time::Time,
};

/// The clock by which a node stamps its messages: run time, until it gets one of its own.
#[derive(Debug, Default)]
pub(crate) struct StampClock {
    is_own: AtomicBool,
    clock: Mutex<LocalClock>,
}

impl StampClock {
    /// Shows what `clock` shows from now on.
    pub(crate) fn set(&self, clock: LocalClock) {
        *lock(&self.clock) = clock;
        self.is_own.store(true, Ordering::Relaxed);
    }

    /// Returns what it shows at run time `now`.
    #[inline]
    pub(crate) fn shows(&self, now: Time) -> Time {
        if self.is_own.load(Ordering::Relaxed) {
            lock(&self.clock).shows(now)
        } else {
            now
        }
    }
}

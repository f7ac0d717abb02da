//! The clock by which a node stamps its messages.

use std::fmt;

use crate::{
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, Ordering},
        lock,
    },
    time::Time,
};

/// What a node's own clock shows at a run time.
pub type Stamps = Arc<dyn Fn(Time) -> Time + Send + Sync>;

/// The clock by which a node stamps its messages: run time, until it gets one of its own.
#[derive(Default)]
pub(crate) struct StampClock {
    is_own: AtomicBool,
    stamps: Mutex<Option<Stamps>>,
}

impl StampClock {
    /// Shows what `stamps` returns from now on.
    pub(crate) fn set(&self, stamps: Stamps) {
        *lock(&self.stamps) = Some(stamps);
        self.is_own.store(true, Ordering::Relaxed);
    }

    /// What it shows at run time `now`.
    #[inline]
    pub(crate) fn shows(&self, now: Time) -> Time {
        if self.is_own.load(Ordering::Relaxed) {
            let stamps = lock(&self.stamps).clone();
            stamps.map_or(now, |stamps| stamps(now))
        } else {
            now
        }
    }
}

impl fmt::Debug for StampClock {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("StampClock").finish_non_exhaustive()
    }
}

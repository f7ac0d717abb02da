//! How long the last tick of a node took.

use std::time::Duration;

use crate::sync::{
    Arc,
    atomic::{AtomicU64, Ordering},
};

/// Tells a node how long its last tick took, in run time: what it is set to take, or under
/// the real clock what it took; see [`Wiring::last_tick`](crate::Wiring::last_tick). A run
/// that is executed again has the same durations.
#[derive(Clone, Debug)]
pub struct LastTick(Arc<AtomicU64>);

impl LastTick {
    /// No tick is over.
    const NONE: u64 = u64::MAX;

    pub(crate) fn new() -> Self {
        Self(Arc::new(AtomicU64::new(Self::NONE)))
    }

    pub(crate) fn set(&self, took: Duration) {
        let nanos = u64::try_from(took.as_nanos()).unwrap_or(Self::NONE - 1);
        self.0.store(nanos, Ordering::Relaxed);
    }

    /// Returns the duration of the tick that was over since the last call, if one was.
    pub fn take(&self) -> Option<Duration> {
        let nanos = self.0.swap(Self::NONE, Ordering::Relaxed);
        (nanos != Self::NONE).then(|| Duration::from_nanos(nanos))
    }
}

//! The counters of a topic and of its subscriptions.

use super::RateWindow;
use crate::runtime::{
    depth::Depth,
    sync::atomic::{AtomicU64, AtomicUsize, Ordering},
    time::Time,
};

/// The counters of a topic, readable without a lock.
#[derive(Debug)]
pub(crate) struct TopicCounters {
    pub(crate) published: AtomicU64,
    /// Messages lost by a link.
    pub(crate) lost: AtomicU64,
    /// Messages delivered by a link.
    pub(crate) delivered: AtomicU64,
    /// Of these, messages that arrived after a newer one.
    pub(crate) overtaken: AtomicU64,
    /// Messages in flight.
    pub(crate) in_flight: AtomicU64,
    pub(crate) depth: AtomicUsize,
    pub(crate) window: RateWindow,
    /// Run time of the newest message, plus one nanosecond; zero before the first.
    pub(crate) newest: AtomicU64,
}

impl TopicCounters {
    pub(crate) fn new(depth: Depth) -> Self {
        Self {
            published: AtomicU64::new(0),
            lost: AtomicU64::new(0),
            delivered: AtomicU64::new(0),
            overtaken: AtomicU64::new(0),
            in_flight: AtomicU64::new(0),
            depth: AtomicUsize::new(depth.get()),
            window: RateWindow::default(),
            newest: AtomicU64::new(0),
        }
    }

    /// Counts a message published at run time `now`.
    pub(crate) fn note(&self, now: Time) {
        self.window.count(now);
        let newest = now.as_nanos().saturating_add(1);
        self.newest.store(newest, Ordering::Relaxed);
    }

    pub(crate) fn newest(&self) -> Option<Time> {
        let newest = self.newest.load(Ordering::Relaxed).checked_sub(1)?;
        Some(Time::from_nanos(newest))
    }
}

/// Read position and losses of one subscription. Written under the queue's lock only,
/// read by observers at any time.
#[derive(Debug, Default)]
pub(crate) struct ReadMark {
    /// Sequence number of the oldest unseen message.
    pub(crate) next_unread: AtomicU64,
    pub(crate) dropped: AtomicU64,
    pub(crate) drops: RateWindow,
}

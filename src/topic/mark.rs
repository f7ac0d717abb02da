//! How far a subscription has read.

use crate::sync::atomic::AtomicU64;

/// Read position and losses of one subscription, written under the lock of the queue only.
#[derive(Debug, Default)]
pub(crate) struct ReadMark {
    /// Sequence number of the oldest unseen message.
    pub(super) next_unread: AtomicU64,
    pub(super) dropped: AtomicU64,
    /// Its place among the readers of the topic in a graph; `None` outside.
    pub(super) reader: Option<usize>,
}

impl ReadMark {
    /// A reader that has seen all messages before number `next`.
    pub(super) fn new(next: u64, reader: Option<usize>) -> Self {
        Self {
            next_unread: AtomicU64::new(next),
            dropped: AtomicU64::new(0),
            reader,
        }
    }
}

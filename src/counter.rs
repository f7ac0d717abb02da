//! Counts the ticks of a node.

use crate::{
    record::TickId,
    sync::atomic::{AtomicU64, Ordering},
};

/// Counts the ticks of a node, so that its ends of topics know in which one it reads and publishes.
#[derive(Debug, Default)]
pub(crate) struct TickCounter {
    /// Index of the node.
    node: usize,
    /// Number of ticks that have begun.
    begun: AtomicU64,
}

impl TickCounter {
    /// A counter for the node with this index.
    pub(crate) fn new(node: usize) -> Self {
        Self {
            node,
            begun: AtomicU64::new(0),
        }
    }

    /// Begins the next tick. Only the thread that runs the node calls this.
    #[inline]
    pub(crate) fn begin(&self) {
        let begun = self.begun.load(Ordering::Relaxed);
        self.begun.store(begun + 1, Ordering::Relaxed);
    }

    /// Number of the tick that began last, counted from zero.
    #[inline]
    pub(crate) fn number(&self) -> u64 {
        self.begun.load(Ordering::Relaxed).saturating_sub(1)
    }

    /// The tick that began last.
    #[inline]
    pub(crate) fn tick(&self) -> TickId {
        TickId {
            node: self.node,
            number: self.number(),
        }
    }
}

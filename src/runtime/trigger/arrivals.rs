//! Messages on their way to the nodes that they trigger.

use crate::runtime::{
    sync::{
        Mutex,
        atomic::{AtomicBool, Ordering},
        lock,
    },
    time::Time,
};

/// A message that arrives for a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Arrival {
    pub(crate) at: Time,
    /// Index of the node.
    pub(crate) node: usize,
    /// Number of the topic among those that trigger the node.
    pub(crate) input: usize,
}

/// The arrivals of the messages that were published since the last look.
#[derive(Debug, Default)]
pub(crate) struct Arrivals {
    /// Whether there are any, so that without them a look costs one load only.
    any: AtomicBool,
    list: Mutex<Vec<Arrival>>,
}

impl Arrivals {
    /// Adds an arrival.
    pub(crate) fn add(&self, arrival: Arrival) {
        lock(&self.list).push(arrival);
        self.any.store(true, Ordering::Release);
    }

    /// Removes all, in the order of publication.
    pub(crate) fn take(&self) -> Vec<Arrival> {
        match self.any.swap(false, Ordering::Acquire) {
            true => std::mem::take(&mut *lock(&self.list)),
            false => Vec::new(),
        }
    }
}

//! The arrivals of messages that trigger nodes: announced as they are published, for the schedule
//! to plan, or for the threads that wait.

use serde::{Deserialize, Serialize};

use crate::{
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, Ordering},
        lock,
    },
    time::Time,
};

/// A message that arrives for a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Arrival {
    /// Run time of its delivery.
    pub at: Time,
    /// Index of the node.
    pub node: usize,
    /// Number of the topic in the list of topics that trigger the node.
    pub input: usize,
}

/// Wakes a node for a message that has arrived, or will.
pub trait Wake: Send + Sync {
    /// On the thread of the publisher, which holds the lock of the topic: it must be quick.
    fn wake(&self, arrival: Arrival);
}

/// The arrivals of the messages that were published since the last look.
#[derive(Default)]
pub(crate) struct Arrivals {
    /// Whether there are any, so that without them a look costs one load only.
    any: AtomicBool,
    list: Mutex<ArrivalList>,
}

#[derive(Default)]
struct ArrivalList {
    arrivals: Vec<Arrival>,
    /// If set, receives arrivals at once.
    wake: Option<Arc<dyn Wake>>,
}

impl Arrivals {
    /// Adds an arrival.
    pub(crate) fn add(&self, arrival: Arrival) {
        let mut list = lock(&self.list);
        match &list.wake {
            Some(wake) => wake.wake(arrival),
            None => {
                list.arrivals.push(arrival);
                self.any.store(true, Ordering::Release);
            }
        }
    }

    /// Forwards all arrivals to `wake` from now on, in place of the list.
    pub(crate) fn forward_to(&self, wake: Option<Arc<dyn Wake>>) {
        lock(&self.list).wake = wake;
    }

    /// Removes all, in the order of publication.
    pub(crate) fn take(&self) -> Vec<Arrival> {
        if self.any.load(Ordering::Acquire) {
            self.take_some()
        } else {
            Vec::new()
        }
    }

    #[cold]
    fn take_some(&self) -> Vec<Arrival> {
        let mut list = lock(&self.list);
        self.any.store(false, Ordering::Release);
        std::mem::take(&mut list.arrivals)
    }
}

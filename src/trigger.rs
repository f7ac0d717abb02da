//! Topics that trigger a node: what a scheduler takes from them, and the arrivals that it hears of.
//!
//! A message is taken when a scheduler calls the node, as a ROS subscription's callback takes it:
//! one message for each call, the oldest that its queue keeps. Once the messages taken make a
//! set, the node ticks, and its subscriptions read that set.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::{
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, Ordering},
        lock,
    },
    time::Time,
};

/// A topic that triggers a node, regardless of its payload.
pub trait Intake: Send {
    /// Run time of the delivery of the oldest message that was not yet taken.
    fn oldest(&self, now: Time) -> Option<Time>;

    /// Number of messages that wait at `now`.
    fn waiting(&self, now: Time) -> usize;

    /// Takes the oldest of them.
    fn take(&mut self, now: Time) -> Option<TakenMessage>;

    /// Lets the subscription read the message taken as number `seq`.
    fn choose(&mut self, seq: u64);

    /// Forgets the messages taken before number `seq`; all of them without a `seq`.
    fn forget_before(&mut self, seq: Option<u64>);
}

/// A message taken from a queue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TakenMessage {
    /// Its sequence number.
    pub seq: u64,
    /// Run time of the sensing behind it.
    pub sensed: Time,
    /// Run time of its delivery.
    pub arrived: Time,
}

/// A message that arrives for a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Arrival {
    /// Run time of its delivery.
    pub at: Time,
    /// Index of the node.
    pub node: usize,
    /// Number of the topic among those that trigger the node.
    pub input: usize,
}

impl fmt::Debug for Arrivals {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Arrivals").finish_non_exhaustive()
    }
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
    /// Has them at once, while it is there.
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

    /// Has `wake` get all from now on, in place of the list.
    pub(crate) fn forward_to(&self, wake: Option<Arc<dyn Wake>>) {
        lock(&self.list).wake = wake;
    }

    /// Removes all, in the order of publication.
    pub(crate) fn take(&self) -> Vec<Arrival> {
        match self.any.load(Ordering::Acquire) {
            true => self.take_some(),
            false => Vec::new(),
        }
    }

    #[cold]
    fn take_some(&self) -> Vec<Arrival> {
        let mut list = lock(&self.list);
        self.any.store(false, Ordering::Release);
        std::mem::take(&mut list.arrivals)
    }
}

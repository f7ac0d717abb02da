//! The counters of a node, of a topic and of its subscriptions.

use std::{collections::VecDeque, time::Duration};

use super::RateWindow;
use crate::{
    depth::Depth,
    sync::{
        Mutex,
        atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering},
        bump, lock,
    },
    time::{Hz, Time},
};

/// The most flights that are kept.
const MOST_FLIGHTS: usize = 256;

/// How long a flight is kept after its end.
const KEPT: Duration = Duration::from_secs(1);

/// The way of one message through a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Flight {
    /// Run time of its release.
    pub released: Time,
    /// Run time of its delivery; `None` if it is lost.
    pub arrives: Option<Time>,
}

/// The counters of a node, readable without a lock. They share one allocation,
/// because each tick writes some of them.
#[derive(Debug)]
pub(crate) struct NodeCounters {
    pub(crate) ticks: AtomicU64,
    pub(crate) overruns: AtomicU64,
    pub(crate) micro_hz: AtomicU64,
    pub(crate) busy: AtomicBool,
    pub(crate) crashed: AtomicBool,
}

impl NodeCounters {
    pub(crate) fn new(hz: Hz) -> Self {
        Self {
            ticks: AtomicU64::new(0),
            overruns: AtomicU64::new(0),
            micro_hz: AtomicU64::new(hz.as_micro()),
            busy: AtomicBool::new(false),
            crashed: AtomicBool::new(false),
        }
    }
}

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
    /// Losses on the link.
    pub(crate) losses: RateWindow,
    /// Recent ways through the link; empty without one.
    flights: Mutex<VecDeque<Flight>>,
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
            losses: RateWindow::default(),
            flights: Mutex::default(),
            newest: AtomicU64::new(0),
        }
    }

    /// Counts a message published at run time `now`.
    #[inline]
    pub(crate) fn note(&self, now: Time) {
        self.window.count(now);
        let newest = now.as_nanos().saturating_add(1);
        self.newest.store(newest, Ordering::Relaxed);
    }

    /// Notes the way of a message through a link.
    pub(crate) fn fly(&self, flight: Flight) {
        let now = flight.released;
        if flight.arrives.is_none() {
            bump(&self.lost);
            self.losses.count(now);
        }
        let mut flights = lock(&self.flights);
        let over = |flight: &Flight| {
            let end = flight.arrives.unwrap_or(flight.released);
            end + KEPT < now
        };
        while flights.len() >= MOST_FLIGHTS || flights.front().is_some_and(over) {
            flights.pop_front();
        }
        flights.push_back(flight);
    }

    /// The recent ways through the link.
    pub(crate) fn flights(&self) -> Vec<Flight> {
        lock(&self.flights).iter().copied().collect()
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

//! The figures of a node, of a topic and of its readers.

use std::{collections::VecDeque, time::Duration};

use ratelab::{
    Depth, Head, Hz, NodeTopology, TickTimes, Time, TopicTopology,
    sync::{
        Mutex,
        atomic::{AtomicBool, AtomicU64, Ordering},
        bump, lock,
    },
};

use super::{meter::Meter, push_age::PushAge, window::RateWindow};

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

/// The figures of a node.
#[derive(Debug)]
pub(super) struct NodeCounters {
    pub(super) ticks: AtomicU64,
    pub(super) overruns: AtomicU64,
    micro_hz: AtomicU64,
    pub(super) busy: AtomicBool,
    pub(super) crashed: AtomicBool,
    /// Whether it runs in another process.
    pub(super) remote: AtomicBool,
    pub(super) lateness: Meter,
    pub(super) tick_time: Meter,
    pub(super) response: Meter,
    /// Its own measurements.
    pub(super) meters: Vec<Meter>,
    pub(super) push_age: PushAge,
}

impl NodeCounters {
    pub(super) fn new(node: &NodeTopology) -> Self {
        Self {
            ticks: AtomicU64::new(0),
            overruns: AtomicU64::new(0),
            micro_hz: AtomicU64::new(node.hz.as_micro()),
            busy: AtomicBool::new(false),
            crashed: AtomicBool::new(false),
            remote: AtomicBool::new(false),
            lateness: Meter::default(),
            tick_time: Meter::default(),
            response: Meter::default(),
            meters: node.meters.iter().map(|_| Meter::default()).collect(),
            push_age: PushAge::default(),
        }
    }

    /// The rate in force, of a node with a timer.
    pub(super) fn hz(&self) -> Hz {
        Hz::from_micro(self.micro_hz.load(Ordering::Relaxed))
    }

    pub(super) fn set_hz(&self, hz: Hz) {
        self.micro_hz.store(hz.as_micro(), Ordering::Relaxed);
    }

    /// Adds a tick: how late it began and how long it took, where that was measured.
    pub(super) fn tick(&self, times: &TickTimes) {
        if let Some(lateness) = times.lateness {
            self.lateness.record(lateness);
        }
        if let Some(took) = times.took {
            self.tick_time.record(took);
            self.response
                .record(times.lateness.unwrap_or_default() + took);
        }
    }

    pub(super) fn set_crashed(&self, crashed: bool) {
        self.busy.store(false, Ordering::Relaxed);
        self.crashed.store(crashed, Ordering::Relaxed);
    }
}

/// The figures of a topic.
#[derive(Debug)]
pub(super) struct TopicCounters {
    pub(super) published: AtomicU64,
    /// Messages lost by a link.
    pub(super) lost: AtomicU64,
    /// Messages that a link was given and did not lose.
    flown: AtomicU64,
    /// Messages delivered by a link.
    delivered: AtomicU64,
    /// Of these, messages that arrived after a newer one.
    pub(super) overtaken: AtomicU64,
    depth: Mutex<Depth>,
    pub(super) window: RateWindow,
    /// Losses on the link.
    pub(super) losses: RateWindow,
    /// Recent ways through the link; empty without one.
    flights: Mutex<VecDeque<Flight>>,
    /// Run time of the newest message, plus one nanosecond; zero before the first.
    newest: AtomicU64,
    pub(super) readers: Vec<ReaderCounters>,
}

/// The figures of a reader of a topic.
#[derive(Debug, Default)]
pub(super) struct ReaderCounters {
    /// Messages lost before it had seen them.
    pub(super) dropped: AtomicU64,
    pub(super) drops: RateWindow,
    /// Ages of the messages that it read, at that time.
    pub(super) ages: Meter,
}

impl TopicCounters {
    pub(super) fn new(topic: &TopicTopology) -> Self {
        let readers = topic.readers.iter();
        Self {
            published: AtomicU64::new(0),
            lost: AtomicU64::new(0),
            flown: AtomicU64::new(0),
            delivered: AtomicU64::new(0),
            overtaken: AtomicU64::new(0),
            depth: Mutex::new(topic.depth),
            window: RateWindow::default(),
            losses: RateWindow::default(),
            flights: Mutex::default(),
            newest: AtomicU64::new(0),
            readers: readers.map(|_| ReaderCounters::default()).collect(),
        }
    }

    /// Counts a message, which goes through a `link` or at once to its readers.
    #[inline]
    pub(super) fn sent(&self, head: &Head, link: bool) {
        self.published
            .store(head.seq.saturating_add(1), Ordering::Relaxed);
        self.window.count(head.at);
        let newest = head.at.as_nanos().saturating_add(1);
        self.newest.store(newest, Ordering::Relaxed);
        if link {
            self.fly(Flight {
                released: head.at,
                arrives: head.arrives,
            });
        }
    }

    /// Notes the way of a message through a link.
    fn fly(&self, flight: Flight) {
        let now = flight.released;
        match flight.arrives {
            Some(_) => bump(&self.flown),
            None => {
                bump(&self.lost);
                self.losses.count(now);
            }
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

    /// Counts a delivery by a link.
    pub(super) fn delivered(&self, overtaken: bool) {
        bump(&self.delivered);
        if overtaken {
            bump(&self.overtaken);
        }
    }

    /// Messages in flight.
    pub(super) fn in_flight(&self) -> u64 {
        let delivered = self.delivered.load(Ordering::Relaxed);
        let flown = self.flown.load(Ordering::Relaxed);
        flown.saturating_sub(delivered)
    }

    pub(super) fn depth(&self) -> Depth {
        *lock(&self.depth)
    }

    /// Sets the queue depth; returns the one before.
    pub(super) fn set_depth(&self, depth: Depth) -> Depth {
        std::mem::replace(&mut lock(&self.depth), depth)
    }

    /// The recent ways through the link.
    pub(super) fn flights(&self) -> Vec<Flight> {
        lock(&self.flights).iter().copied().collect()
    }

    pub(super) fn newest(&self) -> Option<Time> {
        let newest = self.newest.load(Ordering::Relaxed).checked_sub(1)?;
        Some(Time::from_nanos(newest))
    }
}

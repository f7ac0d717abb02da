//! The account of a topic and of its readers.

use std::{collections::VecDeque, time::Duration};

use ratelab::{Depth, Head, Time, TopicRecord, TopicTopology, sync::Arc};

use crate::distribution::Distribution;

/// The most flights that are kept.
const MOST_FLIGHTS: usize = 256;

/// How long a flight is kept after its end.
const KEPT: Duration = Duration::from_secs(1);

/// What the records of a topic add up to.
#[derive(Clone, Debug)]
pub struct TopicAccount {
    /// Its name.
    pub name: Arc<str>,
    /// Queue depth.
    pub depth: Depth,
    /// Messages published so far.
    pub published: u64,
    /// Messages lost by its link.
    pub lost: u64,
    /// Messages that its link delivered after a newer one: these are never read.
    pub overtaken: u64,
    /// Recent ways of messages through its link; empty without one.
    pub flights: VecDeque<Flight>,
    /// Run time of the newest message; `None` before the first.
    pub newest: Option<Time>,
    /// The nodes that publish to it, by their indices.
    pub publishers: Vec<usize>,
    /// The nodes that read it.
    pub readers: Vec<ReaderAccount>,
    /// Messages that a link was given and did not lose, and of these the delivered ones.
    flown: u64,
    delivered: u64,
    sent: RateWindow,
    /// Losses on the link.
    losses: RateWindow,
}

/// What a node has read of a topic.
#[derive(Clone, Debug)]
pub struct ReaderAccount {
    /// The reading node, by its index.
    pub node: usize,
    /// Messages evicted before the node saw them.
    pub dropped: u64,
    /// Messages that its match took and used in no set. In accounts of a recording the first reader
    /// holds the total of all readers, set at the end.
    pub unmatched: u64,
    /// Ages of the messages when the node read them.
    pub ages: Distribution,
    pub(crate) drops: RateWindow,
}

/// The way of one message through a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Flight {
    /// Run time of its release.
    pub released: Time,
    /// Run time of its delivery; `None` if it is lost.
    pub arrives: Option<Time>,
}

impl TopicAccount {
    /// Creates the account of `topic` before its first record.
    pub(crate) fn new(topic: &TopicTopology) -> Self {
        let readers = topic.readers.iter().map(|node| ReaderAccount {
            node: *node,
            dropped: 0,
            unmatched: 0,
            ages: Distribution::default(),
            drops: RateWindow::default(),
        });
        Self {
            name: topic.name.as_str().into(),
            depth: topic.depth,
            published: 0,
            lost: 0,
            overtaken: 0,
            flights: VecDeque::new(),
            newest: None,
            publishers: topic.publishers.clone(),
            readers: readers.collect(),
            flown: 0,
            delivered: 0,
            sent: RateWindow::default(),
            losses: RateWindow::default(),
        }
    }

    /// Adds a record.
    #[inline]
    pub(crate) fn add(&mut self, record: &TopicRecord<'_>) {
        match record {
            TopicRecord::Sent { head, link, .. } => self.send(head, *link),
            TopicRecord::Delivered { overtaken, .. } => {
                self.delivered += 1;
                self.overtaken += u64::from(*overtaken);
            }
            TopicRecord::Dropped { reader, at } => {
                if let Some(reader) = reader.and_then(|reader| self.readers.get_mut(reader)) {
                    reader.dropped += 1;
                    reader.drops.count(*at, 1);
                }
            }
            TopicRecord::Unmatched { reader, count } => {
                if let Some(reader) = self.readers.get_mut(*reader) {
                    reader.unmatched += count;
                }
            }
            TopicRecord::Read { reader, age, .. } => {
                if let Some(reader) = self.readers.get_mut(*reader) {
                    reader.ages.add(*age);
                }
            }
            TopicRecord::Depth(depth) => self.depth = *depth,
            TopicRecord::Matched { .. } => {}
        }
    }

    /// Adds a message, which goes through a `link` or at once to its readers.
    fn send(&mut self, head: &Head, link: bool) {
        self.published = head.seq.saturating_add(1);
        self.sent.count(head.at, 1);
        self.newest = Some(head.at);
        if link {
            self.fly(head.at, head.arrives);
        }
    }

    /// Notes the way of a message through a link, released at run time `now`.
    fn fly(&mut self, now: Time, arrives: Option<Time>) {
        match arrives {
            Some(_) => self.flown += 1,
            None => {
                self.lost += 1;
                self.losses.count(now, 1);
            }
        }
        let over = |flight: &Flight| flight.arrives.unwrap_or(flight.released) + KEPT < now;
        while self.flights.len() >= MOST_FLIGHTS || self.flights.front().is_some_and(over) {
            self.flights.pop_front();
        }
        let released = now;
        self.flights.push_back(Flight { released, arrives });
    }

    /// Returns the messages in flight at the last publication or reading, or at the end of the run.
    pub fn in_flight(&self) -> u64 {
        self.flown.saturating_sub(self.delivered)
    }

    /// Returns messages per second in the last second before run time `now`.
    pub fn per_second(&self, now: Time) -> f64 {
        self.sent.per_second(now)
    }

    /// Mean messages per second of a run up to `now`.
    pub fn average(&self, now: Time) -> f64 {
        let seconds = now.as_secs_f64();
        if seconds > 0.0 {
            self.published as f64 / seconds
        } else {
            0.0
        }
    }

    /// Returns whether a node reads it.
    pub fn is_read(&self) -> bool {
        !self.readers.is_empty()
    }

    /// Returns the messages lost unread, over all readers.
    pub fn dropped(&self) -> u64 {
        self.readers.iter().map(|reader| reader.dropped).sum()
    }

    /// Returns the messages that matches took and used in no set, over all readers.
    pub fn unmatched(&self) -> u64 {
        self.readers.iter().map(|reader| reader.unmatched).sum()
    }

    /// Returns the messages dropped unread within the last second.
    pub fn dropped_lately(&self, now: Time) -> u64 {
        self.readers
            .iter()
            .map(|reader| reader.dropped_lately(now))
            .sum()
    }

    /// Returns the messages that its link lost within the last second.
    pub fn lost_lately(&self, now: Time) -> u64 {
        self.losses.lately(now)
    }
}

impl ReaderAccount {
    /// Returns the messages evicted within the last second.
    pub fn dropped_lately(&self, now: Time) -> u64 {
        self.drops.lately(now)
    }
}

/// Width of one slice of the window.
const SLICE_NANOS: u64 = 100_000_000;

/// Slices in the window: one second.
const WINDOW: u64 = 10;

/// Slices kept: more than the window, so that a look slightly into the past or the future
/// still finds complete ones.
const SLICES: usize = 16;

/// Counts events per slice of run time.
#[derive(Clone, Debug, Default)]
pub(crate) struct RateWindow {
    /// The number of each slice, and its events.
    slices: [(u64, u32); SLICES],
}

impl RateWindow {
    /// Counts events at `stamp`, which may be earlier than the last one.
    pub(crate) fn count(&mut self, stamp: Time, events: u32) {
        let number = slice_number(stamp);
        let slice = &mut self.slices[number as usize % SLICES];
        if slice.0 < number {
            *slice = (number, 0);
        }
        // What is older than all kept slices is left out.
        if slice.0 == number {
            slice.1 = slice.1.saturating_add(events);
        }
    }

    /// Events per second in the last second of complete slices before `now`; in the first
    /// second of a run, over the elapsed part.
    pub(crate) fn per_second(&self, now: Time) -> f64 {
        let current = slice_number(now);
        let first = current.saturating_sub(WINDOW).max(1);
        if first == current {
            return 0.0;
        }
        let events: u64 = (first..current).map(|number| self.events_in(number)).sum();
        events as f64 * 1e9 / ((current - first) * SLICE_NANOS) as f64
    }

    /// Events within the last second, including the current slice.
    pub(crate) fn lately(&self, now: Time) -> u64 {
        let current = slice_number(now);
        let first = current.saturating_sub(WINDOW).max(1);
        (first..=current).map(|number| self.events_in(number)).sum()
    }

    fn events_in(&self, number: u64) -> u64 {
        let (held, events) = self.slices[number as usize % SLICES];
        if held == number { events.into() } else { 0 }
    }
}

/// Returns the number of a slice; numbers start at one, so that zero marks an empty one.
fn slice_number(time: Time) -> u64 {
    time.as_nanos() / SLICE_NANOS + 1
}

//! Messages in flight on a link.

use std::{
    collections::{BTreeMap, BTreeSet},
    time::Duration,
};

use super::{
    chance::Chance,
    draw::Draw,
    link::{Burst, Link},
    message::Message,
    time::Time,
};

/// Number of retries after which a message counts as lost.
const MOST_RETRIES: u64 = 1_000_000;

/// The messages of a topic that are released and not yet delivered, with the state of its
/// link.
#[derive(Debug)]
pub(crate) struct Transit<T> {
    seed: u64,
    topic: String,
    link: Link,
    /// Whether a burst of losses is in progress.
    bad: bool,
    lose: BTreeSet<u64>,
    postpone: BTreeMap<u64, Duration>,
    /// The messages by delivery time and sequence number.
    messages: BTreeMap<(Time, u64), Message<T>>,
    /// Time of the latest delivery so far.
    latest: Time,
    /// The newest released message, with its arrival time, or `None` if it is lost.
    pub(crate) newest: Option<(Message<T>, Option<Time>)>,
    /// One more than the highest delivered sequence number.
    pub(crate) next_delivered: u64,
}

impl<T: Clone> Transit<T> {
    /// Creates a perfect link on `topic`, where all messages before `next` are delivered
    /// and `newest` is the last of them.
    pub(crate) fn new(seed: u64, topic: &str, next: u64, newest: Option<Message<T>>) -> Self {
        let newest = newest.map(|message| (message.clone(), Some(message.stamp)));
        Self {
            seed,
            topic: topic.to_owned(),
            link: Link::NONE,
            bad: false,
            lose: BTreeSet::new(),
            postpone: BTreeMap::new(),
            messages: BTreeMap::new(),
            latest: Time::ZERO,
            newest,
            next_delivered: next,
        }
    }

    /// Sets another link, which begins without a burst; returns the previous one.
    pub(crate) fn set_link(&mut self, link: Link) -> Link {
        self.bad = false;
        std::mem::replace(&mut self.link, link)
    }

    /// Marks message number `seq` as lost.
    pub(crate) fn lose(&mut self, seq: u64) {
        self.lose.insert(seq);
    }

    /// Sets an extra `delay` for message number `seq`; returns the previous one.
    pub(crate) fn postpone(&mut self, seq: u64, delay: Duration) -> Duration {
        self.postpone.insert(seq, delay).unwrap_or_default()
    }

    /// Sends `message`, released at `now`; returns when it arrives, or `None` if it is
    /// lost.
    pub(crate) fn send(&mut self, message: Message<T>, now: Time) -> Option<Time> {
        let seq = message.seq;
        let arrives = self.arrival(seq, now);
        self.newest = Some((message.clone(), arrives));
        arrives.inspect(|at| {
            self.messages.insert((*at, seq), message);
        })
    }

    /// Arrival time of message number `seq`, released at `now`; `None` if it is lost.
    fn arrival(&mut self, seq: u64, now: Time) -> Option<Time> {
        let late = self.time_lost(seq)?;
        let mut at = now + late + self.delay(seq);
        if self.link.in_order || self.link.reliable.is_some() {
            at = at.max(self.latest);
        }
        at = at + self.postpone.remove(&seq).unwrap_or_default();
        self.latest = self.latest.max(at);
        Some(at)
    }

    /// Removes the next message that is delivered by `now`; returns it with its delivery
    /// time.
    pub(crate) fn arrived(&mut self, now: Time) -> Option<(Time, Message<T>)> {
        let next = self.messages.first_entry()?;
        let at = next.key().0;
        (at <= now).then(|| (at, next.remove()))
    }

    /// Number of messages that the next delivery by `now` finds.
    pub(crate) fn arriving(&self, now: Time) -> usize {
        self.messages.range(..=(now, u64::MAX)).count()
    }

    /// Run times of the deliveries after `now`.
    pub(crate) fn arrivals_after(&self, now: Time) -> impl Iterator<Item = Time> {
        let later = self.messages.keys().map(|(at, _)| *at);
        later.skip_while(move |at| *at <= now)
    }

    /// Whether nothing is in flight, the latest release is delivered, and no fault is
    /// planned for later messages.
    pub(crate) fn is_done(&self) -> bool {
        let newest = self.newest.as_ref();
        let all = newest.is_none_or(|(message, _)| message.seq + 1 == self.next_delivered);
        all && self.messages.is_empty() && self.lose.is_empty() && self.postpone.is_empty()
    }

    /// Number of messages in flight.
    pub(crate) fn in_flight(&self) -> usize {
        self.messages.len()
    }

    /// Time that message number `seq` loses to failed attempts; `None` if it is lost.
    fn time_lost(&mut self, seq: u64) -> Option<Duration> {
        let told = self.lose.remove(&seq);
        let by_chance = self.is_lost(seq);
        let by_burst = self.is_in_burst(seq);
        if !(told || by_chance || by_burst) {
            return Some(Duration::ZERO);
        }
        let again = self.link.reliable?;
        let mut retries = 1..=MOST_RETRIES;
        let arrives = retries.find(|retry| !self.is_lost(format_args!("{seq}.{retry}")));
        let waits = arrives.map(|retry| again.saturating_mul(retry as u32));
        Some(waits.unwrap_or(Duration::MAX))
    }

    fn is_lost(&self, number: impl std::fmt::Display) -> bool {
        let loss = self.link.loss;
        loss > 0.0 && self.chance("loss").uniform(number) < loss
    }

    /// Whether a burst takes message number `seq`. Each message advances the state of the
    /// burst.
    fn is_in_burst(&mut self, seq: u64) -> bool {
        let Some(Burst { start, length }) = self.link.burst else {
            return false;
        };
        let u = self.chance("burst").uniform(seq);
        self.bad = if self.bad {
            u >= 1.0 / length
        } else {
            u < start
        };
        self.bad
    }

    fn delay(&self, seq: u64) -> Duration {
        match &self.link.delay {
            Draw::Constant(delay) => *delay,
            delay => delay.at(self.chance("delay").uniform(seq)),
        }
    }

    fn chance<'a>(&'a self, what: &'a str) -> Chance<'a> {
        Chance {
            seed: self.seed,
            what,
            name: &self.topic,
        }
    }
}

//! Messages on their way through a link.

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

/// After how many retries a message is given up as one that never arrives.
const MOST_RETRIES: u64 = 1_000_000;

/// The messages of a topic that were released and not delivered, and what decides on
/// their way.
#[derive(Debug)]
pub(crate) struct Transit<T> {
    seed: u64,
    topic: String,
    link: Link,
    /// Whether a burst of losses is under way.
    bad: bool,
    lose: BTreeSet<u64>,
    postpone: BTreeMap<u64, Duration>,
    /// By when they are delivered, and by sequence number.
    messages: BTreeMap<(Time, u64), Message<T>>,
    /// The latest delivery so far.
    latest: Time,
    /// The newest message that was released, and when it arrives if it does.
    pub(crate) newest: Option<(Message<T>, Option<Time>)>,
    /// One more than the highest sequence number that was delivered.
    pub(crate) next_delivered: u64,
}

impl<T: Clone> Transit<T> {
    /// A perfect link on `topic`, of whose messages those before `next` were
    /// delivered, the last of them `newest`.
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

    /// Puts another link in place, which begins without a burst; returns the one
    /// before.
    pub(crate) fn set_link(&mut self, link: Link) -> Link {
        self.bad = false;
        std::mem::replace(&mut self.link, link)
    }

    /// Message number `seq` is going to be lost.
    pub(crate) fn lose(&mut self, seq: u64) {
        self.lose.insert(seq);
    }

    /// Message number `seq` is going to be delivered so much later; returns by how
    /// much it was before.
    pub(crate) fn postpone(&mut self, seq: u64, delay: Duration) -> Duration {
        self.postpone.insert(seq, delay).unwrap_or_default()
    }

    /// Sends `message`, which is released at `now`; false if it is lost.
    pub(crate) fn send(&mut self, message: Message<T>, now: Time) -> bool {
        let seq = message.seq;
        let arrives = self.arrival(seq, now);
        self.newest = Some((message.clone(), arrives));
        let sent = arrives.map(|at| self.messages.insert((at, seq), message));
        sent.is_some()
    }

    /// When message number `seq` arrives, which is released at `now`; `None` if it is
    /// lost.
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

    /// Takes out the next message that is delivered by `now`, and when that is.
    pub(crate) fn arrived(&mut self, now: Time) -> Option<(Time, Message<T>)> {
        let next = self.messages.first_entry()?;
        let at = next.key().0;
        (at <= now).then(|| (at, next.remove()))
    }

    /// Whether nothing is on its way, all that was released last was delivered, and
    /// nothing is planned for later messages.
    pub(crate) fn is_done(&self) -> bool {
        let newest = self.newest.as_ref();
        let all = newest.is_none_or(|(message, _)| message.seq + 1 == self.next_delivered);
        all && self.messages.is_empty() && self.lose.is_empty() && self.postpone.is_empty()
    }

    /// How many messages are on their way.
    pub(crate) fn in_flight(&self) -> usize {
        self.messages.len()
    }

    /// How long message number `seq` is sent in vain; `None` if it is lost.
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

    /// Whether a burst takes message number `seq`. Each message moves it on.
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

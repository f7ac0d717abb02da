//! What lies between the publishers of a topic and its subscriptions: it decides when a message
//! is delivered, and never sees the payload.

use std::{
    collections::{BTreeMap, BTreeSet},
    time::Duration,
};

use super::{
    chance::Chance,
    draw::Draw,
    link::{Burst, Link},
    time::Time,
};

/// Number of retries after which a message counts as lost.
const MOST_RETRIES: u64 = 1_000_000;

/// A link with its state.
#[derive(Debug)]
pub(crate) struct Channel {
    seed: u64,
    topic: String,
    link: Link,
    /// Whether a burst of losses is in progress.
    bad: bool,
    lose: BTreeSet<u64>,
    postpone: BTreeMap<u64, Duration>,
    /// Time of the latest delivery so far.
    latest: Time,
}

impl Channel {
    /// A perfect link on `topic`.
    pub(crate) fn new(seed: u64, topic: &str) -> Self {
        Self {
            seed,
            topic: topic.to_owned(),
            link: Link::NONE,
            bad: false,
            lose: BTreeSet::new(),
            postpone: BTreeMap::new(),
            latest: Time::ZERO,
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

    /// Whether no fault is planned for later messages.
    pub(crate) fn has_no_faults(&self) -> bool {
        self.lose.is_empty() && self.postpone.is_empty()
    }

    /// When message number `seq` is delivered that is released at `now`; `None` if it is lost.
    pub(crate) fn deliver_at(&mut self, seq: u64, now: Time) -> Option<Time> {
        let late = self.time_lost(seq)?;
        let mut at = now + late + self.delay(seq);
        if self.link.in_order || self.link.reliable.is_some() {
            at = at.max(self.latest);
        }
        at = at + self.postpone.remove(&seq).unwrap_or_default();
        self.latest = self.latest.max(at);
        Some(at)
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

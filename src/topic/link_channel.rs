//! The link between the publishers of a topic and its readers: its state, which decides when a
//! message is delivered, and the messages on their way.

use std::{
    collections::{BTreeMap, BTreeSet},
    time::Duration,
};

use super::message::Message;
use crate::{
    control::{command::KnobRefusal, knob::Knob},
    settings::{
        chance::Chance,
        link::{Burst, Link},
    },
    time::Time,
};

/// Number of retries after which a message stays in flight for good.
const MAX_RETRIES: u64 = 1_000_000;

/// A link with its state.
#[derive(Debug)]
pub(crate) struct LinkChannel {
    seed: u64,
    topic: String,
    link: Link,
    /// Whether a burst of losses is in progress.
    in_burst: bool,
    lose: BTreeSet<u64>,
    postpone: BTreeMap<u64, Duration>,
    /// Time of the latest delivery so far.
    latest: Time,
}

impl LinkChannel {
    /// Creates a perfect link on `topic`.
    pub(crate) fn new(seed: u64, topic: &str) -> Self {
        Self {
            seed,
            topic: topic.to_owned(),
            link: Link::NONE,
            in_burst: false,
            lose: BTreeSet::new(),
            postpone: BTreeMap::new(),
            latest: Time::ZERO,
        }
    }

    /// Returns the time that message number `seq` loses to failed attempts; `None` if it is lost.
    fn time_lost(&mut self, seq: u64) -> Option<Duration> {
        let told = self.lose.remove(&seq);
        let by_chance = self.is_lost(seq);
        let by_burst = self.is_in_burst(seq);
        if !(told || by_chance || by_burst) {
            return Some(Duration::ZERO);
        }
        let again = self.link.reliable?;
        let mut retries = 1..=MAX_RETRIES;
        let arrives = retries.find(|retry| !self.is_lost(format_args!("{seq}.{retry}")));
        let waits = arrives.map(|retry| again.saturating_mul(retry as u32));
        Some(waits.unwrap_or(Duration::MAX))
    }

    fn is_lost(&self, number: impl std::fmt::Display) -> bool {
        let loss = self.link.loss;
        loss > 0.0 && self.chance("loss").uniform(number) < loss
    }

    /// Returns whether a burst takes message number `seq`. Each message advances the state of the
    /// burst.
    fn is_in_burst(&mut self, seq: u64) -> bool {
        let Some(Burst { start, length }) = self.link.burst else {
            return false;
        };
        let u = self.chance("burst").uniform(seq);
        self.in_burst = if self.in_burst {
            u >= 1.0 / length
        } else {
            u < start
        };
        self.in_burst
    }

    fn chance<'a>(&'a self, what: &'a str) -> Chance<'a> {
        Chance {
            seed: self.seed,
            what,
            name: &self.topic,
        }
    }
}

impl LinkChannel {
    /// Returns when message number `seq`, published at `now`, is delivered; `None` if it is lost. A
    /// message that is delivered after a later one is overtaken, and nobody reads it.
    pub(crate) fn deliver_at(&mut self, seq: u64, now: Time) -> Option<Time> {
        let late = self.time_lost(seq)?;
        let mut at = now + late + self.link.delay.sample(self.chance("delay"), seq);
        if self.link.in_order || self.link.reliable.is_some() {
            at = at.max(self.latest);
        }
        at = at + self.postpone.remove(&seq).unwrap_or_default();
        self.latest = self.latest.max(at);
        Some(at)
    }

    /// Returns whether it delivers every message to come at once.
    pub(crate) fn is_perfect(&self) -> bool {
        self.link == Link::NONE && self.lose.is_empty() && self.postpone.is_empty()
    }

    /// Sets a knob of the topic; returns the one that was in force.
    ///
    /// # Errors
    /// [`KnobRefusal`] for a knob of a node.
    pub(crate) fn set(&mut self, knob: &Knob) -> Result<Knob, KnobRefusal> {
        match knob {
            Knob::Link { topic, link } => {
                // It begins without a burst.
                self.in_burst = false;
                Ok(Knob::Link {
                    topic: topic.clone(),
                    link: std::mem::replace(&mut self.link, link.clone()),
                })
            }
            Knob::Lose { topic, seq } => {
                self.lose.insert(*seq);
                Ok(Knob::Postpone {
                    topic: topic.clone(),
                    seq: *seq,
                    delay: self.postpone.get(seq).copied().unwrap_or_default(),
                })
            }
            Knob::Postpone { topic, seq, delay } => Ok(Knob::Postpone {
                topic: topic.clone(),
                seq: *seq,
                delay: self.postpone.insert(*seq, *delay).unwrap_or_default(),
            }),
            _ => Err(KnobRefusal::NotFor(knob.to_string(), "topic")),
        }
    }
}

/// The messages of a topic that are published and not yet delivered, with what decides when they
/// are.
pub(crate) struct Transit<T> {
    pub(crate) channel: LinkChannel,
    /// The messages by delivery time and sequence number.
    messages: BTreeMap<(Time, u64), Message<T>>,
    /// The newest message published, with its arrival time, or `None` if it is lost.
    pub(crate) newest: Option<(Message<T>, Option<Time>)>,
    /// One more than the highest delivered sequence number.
    pub(crate) next_delivered: u64,
}

impl<T: Clone> Transit<T> {
    /// Creates the transit of a topic whose messages before `next` are delivered, and `newest` is the last of them, with its
    /// delivery.
    pub(crate) fn new(channel: LinkChannel, next: u64, newest: Option<(Message<T>, Time)>) -> Self {
        Self {
            channel,
            messages: BTreeMap::new(),
            newest: newest.map(|(message, at)| (message, Some(at))),
            next_delivered: next,
        }
    }

    /// Sends `message`, published at `now`; returns when it arrives, or `None` if it is
    /// lost.
    pub(crate) fn send(&mut self, message: Message<T>, now: Time) -> Option<Time> {
        let seq = message.seq;
        let arrives = self.channel.deliver_at(seq, now);
        self.newest = Some((message.clone(), arrives));
        arrives.inspect(|at| {
            self.messages.insert((*at, seq), message);
        })
    }

    /// Removes the next message that is delivered by `now`; returns it with its delivery
    /// time.
    pub(crate) fn arrived(&mut self, now: Time) -> Option<(Time, Message<T>)> {
        let next = self.messages.first_entry()?;
        let at = next.key().0;
        (at <= now).then(|| (at, next.remove()))
    }

    /// Returns run times of the deliveries after `now`.
    pub(crate) fn arrivals_after(&self, now: Time) -> impl Iterator<Item = Time> {
        self.messages
            .keys()
            .map(|(at, _)| *at)
            .skip_while(move |at| *at <= now)
    }

    /// Returns whether nothing is in flight, the newest message is delivered, and later ones are
    /// delivered at once.
    pub(crate) fn is_done(&self) -> bool {
        let newest = self.newest.as_ref();
        let all = newest.is_none_or(|(message, _)| message.seq + 1 == self.next_delivered);
        all && self.messages.is_empty() && self.channel.is_perfect()
    }
}

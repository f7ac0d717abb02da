//! The messages between the publishers of a topic and its readers.

use std::collections::BTreeMap;

use super::{link_channel::LinkChannel, message::Message};
use crate::time::Time;

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
    /// Creates all messages before `next` are delivered, and `newest` is the last of them, with its
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

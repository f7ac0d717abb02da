//! The end of a topic that triggers a node, and what a scheduler takes from it.
//!
//! A message is taken when a scheduler calls the node, as a ROS subscription's callback takes it:
//! one message for each call, the oldest that its queue keeps. Once the messages taken make a
//! set, the node ticks, and its subscriptions read that set.

use std::collections::VecDeque;

use super::{
    Subscription, Topic,
    message::Payload,
    queue::{Bus, TopicReader, TriggerEnd},
};
use crate::{arrival::Arrivals, record::TopicRecord, sync::Arc, time::Time};

/// A topic that triggers a node, regardless of its payload.
pub(crate) trait Intake: Send {
    /// Returns the run time of the delivery of the oldest message that was not yet taken.
    fn oldest(&self, now: Time) -> Option<Time>;

    /// Returns the number of messages that wait at `now`.
    fn waiting(&self, now: Time) -> usize;

    /// Takes the oldest of them.
    fn take(&mut self, now: Time) -> Option<TakenMessage>;

    /// Lets the subscription read the message taken as number `seq`, which no later set has;
    /// `completes` says whether a message of this topic completed the set.
    fn choose(&mut self, seq: u64, completes: bool);

    /// Forgets the messages taken before number `seq`; all of them without a `seq`. Messages that
    /// were never chosen count as unmatched.
    fn forget_before(&mut self, seq: Option<u64>);
}

/// A message taken from a queue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TakenMessage {
    /// Its sequence number.
    pub seq: u64,
    /// Run time of the sensing behind it.
    pub sensed: Time,
    /// Run time of its delivery.
    pub arrived: Time,
}

impl<T: Payload> Topic<T> {
    /// Creates a subscription, the reader at this `place` of the topic, whose messages trigger the
    /// node with index `node` as its input number `input`.
    pub(crate) fn trigger(
        &self,
        place: usize,
        (node, input): (usize, usize),
        arrivals: &Arc<Arrivals>,
    ) -> (Subscription<T>, Box<dyn Intake>) {
        let mut bus = self.0.lock();
        let reader = bus.add_reader(Some(place));
        bus.has_triggers = true;
        bus.readers[reader].trigger = Some(Box::new(TriggerEnd {
            node,
            input,
            arrivals: arrivals.clone(),
            taken: VecDeque::new(),
            chosen: None,
            is_new: false,
        }));
        drop(bus);
        let intake = TopicIntake {
            bus: self.0.clone(),
            reader,
        };
        let bus = self.0.clone();
        (Subscription { bus, reader }, Box::new(intake))
    }
}

/// The end of a topic by which its messages are taken.
struct TopicIntake<T> {
    bus: Arc<Bus<T>>,
    reader: usize,
}

impl<T: Payload> Intake for TopicIntake<T> {
    fn oldest(&self, now: Time) -> Option<Time> {
        let mut bus = self.bus.lock();
        bus.deliver(now);
        let oldest = bus.unread(self.reader).next();
        oldest.map(|(_, at)| *at)
    }

    fn waiting(&self, now: Time) -> usize {
        let mut bus = self.bus.lock();
        bus.deliver(now);
        bus.unread(self.reader).len()
    }

    fn take(&mut self, now: Time) -> Option<TakenMessage> {
        let mut bus = self.bus.lock();
        let queue = &mut *bus;
        queue.deliver(now);
        let (message, arrived) = queue.unread(self.reader).next()?.clone();
        let taken = TakenMessage {
            seq: message.seq,
            sensed: message.sensed(),
            arrived,
        };
        let reader = &mut queue.readers[self.reader];
        reader.next_unread = message.seq + 1;
        reader.trigger.as_mut()?.taken.push_back(message);
        Some(taken)
    }

    fn choose(&mut self, seq: u64, completes: bool) {
        let mut bus = self.bus.lock();
        let reader = &mut bus.readers[self.reader];
        if let Some(end) = &mut reader.trigger {
            let place = end.taken.iter().position(|message| message.seq == seq);
            end.chosen = place.and_then(|place| end.taken.remove(place));
            end.is_new = true;
        }
        if let Some(reader) = reader.place {
            bus.send_record(|| TopicRecord::Matched {
                reader,
                seq,
                completes,
            });
        }
    }

    fn forget_before(&mut self, seq: Option<u64>) {
        let mut bus = self.bus.lock();
        let TopicReader { trigger, place, .. } = &mut bus.readers[self.reader];
        let (Some(end), Some(reader)) = (trigger, place) else {
            return;
        };
        let (kept, taken) = (seq.unwrap_or(u64::MAX), end.taken.len());
        end.taken.retain(|message| message.seq >= kept);
        let (reader, count) = (*reader, (taken - end.taken.len()) as u64);
        if count > 0 {
            bus.send_record(|| TopicRecord::Unmatched { reader, count });
        }
    }
}

impl<T> Drop for TopicIntake<T> {
    fn drop(&mut self) {
        self.bus.lock().readers[self.reader].trigger = None;
    }
}

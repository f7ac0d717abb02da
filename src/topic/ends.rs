//! The two ends of a topic: a node publishes to one, and reads from the other.

use super::{
    message::{Message, Payload, SourceRank},
    queue::{Bus, Publication, Queue},
};
use crate::{
    record::{Derived, TopicRecord},
    sync::Arc,
    time::Time,
};

/// The end of a topic that a node publishes to, with [`Tick::publish`](crate::Tick::publish).
#[derive(Debug)]
pub struct Publisher<T> {
    pub(super) bus: Arc<Bus<T>>,
}

/// The run times of a message that arrives from another process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ForwardedTimes {
    /// Run time of its arrival.
    pub at: Time,
    /// Run time at which it was published there.
    pub stamp: Time,
    /// Run time of the sensing behind it, if that is known.
    pub origin: Option<Time>,
}

impl<T: Payload> Publisher<T> {
    /// Publishes a message that arrives from another process; returns its sequence number.
    pub fn forward(&self, data: T, times: ForwardedTimes) -> u64 {
        self.send(
            data,
            Publication {
                at: times.at,
                stamp: times.stamp,
                origin: times.origin,
                source: SourceRank::UNKNOWN,
                by: None,
                from: Derived::Reads,
            },
        )
    }

    /// Publishes a message; returns its sequence number.
    #[inline]
    pub(crate) fn send(&self, data: T, publication: Publication) -> u64 {
        self.bus.lock().publish(data, publication)
    }

    /// Returns a message to be sent later, at a run time and with a stamp.
    pub(crate) fn held(
        &self,
        data: T,
        publication: Publication,
    ) -> impl FnOnce(Time, Time) + Send + use<T> {
        let bus = self.bus.clone();
        let began = publication.stamp;
        move |at, stamp| {
            let sensed = (stamp != began).then_some(began);
            let publication = Publication {
                at,
                stamp,
                origin: publication.origin.or(sensed),
                ..publication
            };
            bus.lock().publish(data, publication);
        }
    }
}

/// The end of a topic that a node reads from, with [`Tick::read`](crate::Tick::read).
///
/// ```
/// use ratelab::{Depth, Tick, Time, Topic};
///
/// let topic = Topic::new("/range", Depth::ONE);
/// let mut subscription = topic.subscribe();
/// let mut tick = Tick::at(Time::ZERO);
/// assert!(tick.read(&mut subscription).is_none()); // Nothing yet.
///
/// tick.publish(&topic.publisher(), 1.7);
/// for _ in 0..2 {
///     // The newest again and again, until there is a newer one.
///     assert_eq!(tick.read(&mut subscription).expect("published").data, 1.7);
/// }
/// assert_eq!(subscription.dropped(), 0);
/// ```
#[derive(Debug)]
pub struct Subscription<T> {
    pub(super) bus: Arc<Bus<T>>,
    /// Index of its reader in the queue.
    pub(crate) reader: usize,
}

impl<T: Payload> Subscription<T> {
    /// Returns the message that a tick with this `number` reads at run time `now`.
    #[inline]
    pub(crate) fn read(&mut self, now: Time, number: u64) -> Option<Message<T>> {
        let mut bus = self.bus.lock();
        let queue = &mut *bus;
        let message = match &queue.readers[self.reader].trigger {
            Some(end) => end.chosen.clone()?,
            None => {
                if queue.transit.is_some() {
                    queue.deliver(now);
                }
                queue.to_read(self.reader)?.clone()
            }
        };
        self.mark_read(queue, &message, now, number);
        Some(message)
    }

    /// Returns the oldest message that this subscription has not seen.
    pub(crate) fn next_unseen(&mut self, now: Time, number: u64) -> Option<Message<T>> {
        let mut bus = self.bus.lock();
        let queue = &mut *bus;
        let message = match &mut queue.readers[self.reader].trigger {
            Some(end) => {
                let chosen = end.chosen.as_ref().filter(|_| end.is_new);
                let message = chosen?.clone();
                end.is_new = false;
                message
            }
            None => {
                if queue.transit.is_some() {
                    queue.deliver(now);
                }
                queue.unread(self.reader).next()?.0.clone()
            }
        };
        self.mark_read(queue, &message, now, number);
        Some(message)
    }

    /// Moves the read position behind `message`, which is read at run time `now`. That of a trigger
    /// moves as a message is taken.
    #[inline]
    fn mark_read(&self, queue: &mut Queue<T>, message: &Message<T>, now: Time, tick: u64) {
        let reader = &mut queue.readers[self.reader];
        if reader.trigger.is_none() {
            reader.next_unread = message.seq + 1;
        }
        let queue = &*queue;
        if let Some(reader) = queue.readers[self.reader].place {
            queue.send_record(|| TopicRecord::Read {
                reader,
                tick,
                seq: message.seq,
                newest: queue.newest_delivered().unwrap_or(message.seq),
                age: now.since(message.stamp),
            });
        }
    }

    /// Returns the number of its bus, and the index of its reader there.
    #[inline]
    pub(crate) fn key(&self) -> (usize, usize) {
        (Arc::as_ptr(&self.bus).addr(), self.reader)
    }

    /// Returns the number of messages evicted before this subscription saw them.
    pub fn dropped(&self) -> u64 {
        self.bus.peek().readers[self.reader].dropped
    }
}

impl<T> Drop for Subscription<T> {
    fn drop(&mut self) {
        self.bus.lock().readers[self.reader].is_open = false;
    }
}

//! The end of a topic that a node reads from.

use super::{
    message::{Message, Payload},
    queue::{Bus, Queue},
    readers::ReadMark,
};
use crate::{
    record::TopicRecord,
    sync::{Arc, atomic::Ordering},
    time::Time,
};

/// The end of a topic that a node reads from.
///
/// ```
/// use ratelab::{Depth, Time, Topic};
///
/// let topic = Topic::new("/range", Depth::ONE);
/// let mut subscription = topic.subscribe();
/// assert!(subscription.latest(Time::ZERO).is_none()); // Nothing yet.
///
/// topic.publisher().publish(1.7, Time::ZERO, None);
/// for _ in 0..2 {
///     // The newest again and again, until there is a newer one.
///     assert_eq!(subscription.latest(Time::ZERO).expect("published").data, 1.7);
/// }
/// assert_eq!(subscription.dropped(), 0);
/// ```
#[derive(Debug)]
pub struct Subscription<T> {
    pub(super) bus: Arc<Bus<T>>,
    pub(crate) mark: Arc<ReadMark>,
    /// Whether its messages trigger the node, which then reads those of its set.
    pub(super) triggers: bool,
}

impl<T: Payload> Subscription<T> {
    /// Returns the newest message, or `None` before the first. Older messages count as
    /// seen. `now` is the run time of reading, from which the message's age is measured.
    ///
    /// With [`ReadOrder::Oldest`](crate::ReadOrder::Oldest) it returns the oldest unread message
    /// instead. If its messages trigger the node, it returns the one that this tick is for.
    pub fn latest(&mut self, now: Time) -> Option<Message<T>> {
        let mut bus = self.bus.lock();
        let queue = &mut *bus;
        let message = if self.triggers {
            queue
                .triggers
                .as_ref()?
                .reader(&self.mark)?
                .chosen
                .clone()?
        } else {
            if queue.transit.is_some() {
                queue.deliver(now);
            }
            queue.to_read(&self.mark)?.clone()
        };
        self.seen(queue, &message, now);
        Some(message)
    }

    /// Moves the read position behind `message`, which is read at run time `now`.
    #[inline]
    fn seen(&self, queue: &Queue<T>, message: &Message<T>, now: Time) {
        if !self.triggers {
            let next = message.seq + 1;
            self.mark.next_unread.store(next, Ordering::Relaxed);
        }
        if let Some(reader) = self.mark.reader {
            let age = now.since(message.stamp);
            queue.send_record(|| TopicRecord::Read { reader, age });
        }
    }

    /// Returns the oldest message that this subscription has not seen, or `None` if it has
    /// seen all: for nodes that need every message, in the order of delivery. `now` is the
    /// run time of reading.
    pub fn next(&mut self, now: Time) -> Option<Message<T>> {
        let mut bus = self.bus.lock();
        let queue = &mut *bus;
        if queue.transit.is_some() {
            queue.deliver(now);
        }
        let message = queue.oldest_unread(&self.mark)?.clone();
        self.seen(queue, &message, now);
        Some(message)
    }

    /// Number of messages evicted before this subscription saw them.
    pub fn dropped(&self) -> u64 {
        self.mark.dropped.load(Ordering::Relaxed)
    }
}

impl<T> Drop for Subscription<T> {
    fn drop(&mut self) {
        self.bus
            .lock()
            .marks
            .retain(|mark| !Arc::ptr_eq(mark, &self.mark));
    }
}

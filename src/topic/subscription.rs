//! The end of a topic that a node reads from.

use super::{
    message::{Message, Payload},
    queue::{Bus, Queue},
};
use crate::{
    record::{MessageId, TopicRecord},
    sync::Arc,
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
    /// Index of its reader in the queue.
    pub(crate) reader: usize,
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
        let message = match &queue.readers[self.reader].trigger {
            Some(end) => end.chosen.clone()?,
            None => {
                if queue.transit.is_some() {
                    queue.deliver(now);
                }
                queue.to_read(self.reader)?.clone()
            }
        };
        self.seen(queue, &message, now);
        Some(message)
    }

    /// Moves the read position behind `message`, which is read at run time `now`. That of a trigger
    /// moves as a message is taken.
    #[inline]
    fn seen(&self, queue: &mut Queue<T>, message: &Message<T>, now: Time) {
        let reader = &mut queue.readers[self.reader];
        if reader.trigger.is_none() {
            reader.next_unread = message.seq + 1;
        }
        let queue = &*queue;
        if let Some(node) = &queue.readers[self.reader].node {
            queue.send_record(|| TopicRecord::Read {
                reader: node.place,
                tick: node.counter.number(),
                seq: message.seq,
                newest: queue.newest_delivered().unwrap_or(message.seq),
                age: now.since(message.stamp),
            });
        }
    }

    /// Returns the oldest message that this subscription has not seen, or `None` if it has
    /// seen all: for nodes that need every message, in the order of delivery. `now` is the
    /// run time of reading. If its messages trigger the node, it returns the one that this tick is
    /// for, once.
    pub fn next(&mut self, now: Time) -> Option<Message<T>> {
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
        self.seen(queue, &message, now);
        Some(message)
    }

    /// The message of its topic with this sequence number; `None` outside of a graph.
    pub fn message_id(&self, seq: u64) -> Option<MessageId> {
        let queue = self.bus.peek();
        let topic = queue.records.as_ref()?.index();
        Some(MessageId { topic, seq })
    }

    /// Number of messages evicted before this subscription saw them.
    pub fn dropped(&self) -> u64 {
        self.bus.peek().readers[self.reader].dropped
    }
}

impl<T> Drop for Subscription<T> {
    fn drop(&mut self) {
        self.bus.lock().readers[self.reader].is_open = false;
    }
}

//! A named bus between nodes that never call each other.
//!
//! A [`Topic`] is bounded and *latest wins*: a subscription reads the newest message,
//! because for control a stale reading is worse than a lost one. A message that is
//! evicted from the full buffer before a subscription has seen it is **dropped**, and
//! every subscription counts its own drops. This counter makes a rate mismatch visible.
//!
//! | case | effect |
//! |---|---|
//! | publish, room in the buffer | no drop |
//! | publish into a full buffer, oldest message unread by a subscription | that subscription counts one drop |
//! | publish into a full buffer, oldest message already read or passed over | no drop |
//! | `latest()` on a topic that never carried a message | `None` |
//! | `latest()` | the newest message; everything older counts as seen |
//! | `latest()` again with nothing new | the same message again (zero-order hold), no drop |
//! | two subscriptions, one slow | only the slow one counts drops |
//! | subscribing late | `latest()` gives the newest message; earlier ones never count as drops |
//! | depth 0 | refused: [`DepthError`] |
//! | queue made shallower while running | the oldest go; those unread count as dropped |
//! | queue made deeper while running | nothing is lost, nothing returns |
//! | read order oldest | the oldest unread message; the last one again if there is none |
//! | the topic triggers the reader | the message that the tick is for, whatever the read order |
//! | a link | messages enter the queue on delivery; drops and reads happen there |
//!
//! Each row is tested: the first ones in `tests/library/topic.rs`, read order and links in
//! `tests/library/links.rs`, triggers in `tests/library/graph_executors.rs`.

mod channel;
mod intake;
mod message;
mod outbox;

use std::{any::Any, collections::VecDeque};

pub(crate) use self::outbox::Outbox;
pub use self::{
    channel::Channel,
    message::{Message, Payload},
    outbox::Stamps,
};
use self::{channel::Transit, intake::Triggers};

use crate::{
    control::knob::Knob,
    journal::Shared,
    qos::{Depth, ReadOrder},
    record::{Head, Records, TopicRecord},
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
        bump,
    },
    time::Time,
    trigger::Arrival,
};

/// A named, bounded, thread-safe, latest-wins bus.
///
/// Clones are handles to the same bus. Nodes do not hold a topic: they hold an end of it,
/// a [`Publisher`] or a [`Subscription`], which they receive from the
/// [`Graph`](crate::Graph).
///
/// ```
/// use ratelab::{Depth, Time, Topic};
///
/// let topic = Topic::new("/range", Depth::ONE);
/// let publisher = topic.publisher();
/// let mut subscription = topic.subscribe();
///
/// publisher.publish(1.7, Time::from_nanos(1), None);
/// publisher.publish(1.6, Time::from_nanos(2), None);
///
/// let newest = subscription.latest(Time::from_nanos(3)).expect("published");
/// assert_eq!(newest.data, 1.6);
/// assert_eq!(subscription.dropped(), 1); // 1.7 was lost unread
/// ```
#[derive(Debug)]
pub struct Topic<T>(Arc<Bus<T>>);

#[derive(Debug)]
struct Bus<T> {
    queue: Shared<Queue<T>>,
}

struct Queue<T> {
    messages: VecDeque<Message<T>>,
    depth: Depth,
    next_seq: u64,
    /// Run time of the newest publication.
    newest_at: Time,
    order: ReadOrder,
    /// Messages in flight, while the topic has a link.
    transit: Option<Box<Transit<T>>>,
    /// What the nodes need that its messages trigger, if there are any.
    triggers: Option<Box<Triggers<T>>>,
    marks: Vec<Arc<ReadMark>>,
    /// Where its records go, once it is in a graph.
    records: Option<Records>,
}

/// Read position and losses of one subscription, written under the lock of the queue only.
#[derive(Debug, Default)]
pub(crate) struct ReadMark {
    /// Sequence number of the oldest unseen message.
    next_unread: AtomicU64,
    dropped: AtomicU64,
    /// Its place among the readers of the topic in a graph; `None` outside.
    reader: Option<usize>,
}

impl<T> Clone for Topic<T> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

impl<T: Payload> Topic<T> {
    /// Creates a separate bus. A [`Graph`](crate::Graph) checks that names are unique.
    pub fn new(name: impl Into<String>, depth: Depth) -> Self {
        let queue = Queue {
            messages: VecDeque::new(),
            depth,
            next_seq: 0,
            newest_at: Time::ZERO,
            order: ReadOrder::Newest,
            transit: None,
            triggers: None,
            marks: Vec::new(),
            records: None,
        };
        Self(Arc::new(Bus {
            queue: Shared::new(name.into(), queue),
        }))
    }

    /// The topic's name, such as `/obs`.
    pub fn name(&self) -> &str {
        self.0.queue.name()
    }

    /// Creates a publishing end.
    pub fn publisher(&self) -> Publisher<T> {
        Publisher {
            bus: self.0.clone(),
            outbox: None,
        }
    }

    /// The same for a node whose messages are held back in `outbox` during a tick that
    /// takes time.
    pub(crate) fn publisher_through(&self, outbox: &Arc<Outbox>) -> Publisher<T> {
        Publisher {
            bus: self.0.clone(),
            outbox: Some(outbox.clone()),
        }
    }

    /// Creates a reading end with its own read position and drop count. It can read the
    /// newest earlier message, but earlier messages never count as dropped.
    pub fn subscribe(&self) -> Subscription<T> {
        self.subscribe_as(None)
    }

    /// The same for a node, which is this one of the topic's readers.
    pub(crate) fn subscribe_as(&self, reader: Option<usize>) -> Subscription<T> {
        let queue = self.0.queue.peek();
        let transit = queue.transit.as_ref();
        let next = transit.map_or(queue.next_seq, |transit| transit.next_delivered);
        drop(queue);
        self.subscribe_again(Arc::new(ReadMark {
            next_unread: AtomicU64::new(next),
            dropped: AtomicU64::new(0),
            reader,
        }))
    }

    /// Creates a subscription with the read position of a previous one.
    pub(crate) fn subscribe_again(&self, mark: Arc<ReadMark>) -> Subscription<T> {
        let mut queue = self.0.queue.lock();
        queue.marks.push(mark.clone());
        let triggers = queue.triggers.as_ref();
        Subscription {
            bus: self.0.clone(),
            triggers: triggers.is_some_and(|triggers| triggers.knows(&mark)),
            mark,
        }
    }

    /// Its index in the graph; `None` outside of one.
    pub fn index(&self) -> Option<usize> {
        let queue = self.0.queue.peek();
        queue.records.as_ref().map(Records::index)
    }

    /// Whether this is a handle to the same bus, by number.
    pub(crate) fn address(&self) -> usize {
        Arc::as_ptr(&self.0).addr()
    }

    /// Changes the queue depth at run time `now`. Messages that no longer fit are
    /// evicted, oldest first, and counted as dropped by every subscription that had not
    /// seen them. Returns the previous depth.
    pub fn set_depth(&self, depth: Depth, now: Time) -> Depth {
        let mut turn = self.0.queue.lock();
        let queue = &mut *turn;
        queue.deliver_before(now);
        let before = std::mem::replace(&mut queue.depth, depth);
        while queue.messages.len() > queue.depth.get() {
            queue.evict_oldest(now);
        }
        queue.send_record(|| TopicRecord::Depth(depth));
        before
    }

    /// The newest message, read without a subscription, with what a record of it would hold;
    /// `None` before the first.
    pub fn peek(&self) -> Option<(T, Head)> {
        let queue = self.0.queue.peek();
        let (message, head) = queue.newest()?;
        Some((message.data.clone(), head))
    }

    /// Queue depth.
    pub fn depth(&self) -> Depth {
        self.0.queue.peek().depth
    }

    /// Number of messages published so far.
    pub fn published(&self) -> u64 {
        self.0.queue.peek().next_seq
    }
}

/// Makes what lies between the publishers and the readers of a topic, if the graph has any of it.
type NewLink<'a> = &'a dyn Fn() -> Option<Box<dyn Channel>>;

/// A topic, regardless of its payload.
pub(crate) trait AnyTopic: Send {
    /// Turns a knob of the topic, or of the `link` between its publishers and readers, for
    /// messages published from run time `now` on; returns the value before.
    ///
    /// # Errors
    /// The reason, for a knob that the kit does not know, and for a message that is published
    /// already.
    fn turn(&self, knob: &Knob, link: NewLink<'_>, now: Time) -> Result<String, String>;

    /// Queue depth.
    fn depth(&self) -> Depth;

    /// Sends its records on this way.
    fn set_records(&self, records: Records);

    /// Delivers the messages that arrive by `now`. Publishing and reading do the same.
    fn deliver(&self, now: Time);

    /// The messages in flight that arrive after `now`, for the nodes that they trigger.
    fn arrivals_after(&self, now: Time) -> Vec<Arrival>;
}

impl<T: Payload> AnyTopic for Topic<T> {
    fn turn(&self, knob: &Knob, link: NewLink<'_>, now: Time) -> Result<String, String> {
        match knob {
            Knob::Depth { depth, .. } => return Ok(self.set_depth(*depth, now).to_string()),
            Knob::Read { order, .. } => {
                let before = std::mem::replace(&mut self.0.queue.lock().order, *order);
                return Ok(before.to_string());
            }
            _ => {}
        }
        let mut turn = self.0.queue.lock();
        let queue = &mut *turn;
        match knob.message() {
            Some(seq) => queue.is_still_to_come(seq)?,
            None => queue.deliver_before(now),
        }
        if queue.transit.is_none() {
            let channel = link().ok_or_else(|| knob.not_in_kit())?;
            let newest = queue.messages.back().cloned();
            queue.transit = Some(Box::new(Transit::new(channel, queue.next_seq, newest)));
        }
        let transit = queue.transit.as_mut();
        let before = transit.map(|transit| transit.channel.turn(knob));
        // Without a link, and with nothing in flight, it is as fast as a topic that never had one.
        queue.transit.take_if(|transit| transit.is_done());
        before.unwrap_or_else(|| Err(knob.not_in_kit()))
    }

    fn depth(&self) -> Depth {
        Topic::depth(self)
    }

    fn set_records(&self, records: Records) {
        self.0.queue.peek().records = Some(records);
    }

    fn deliver(&self, now: Time) {
        self.0.queue.peek().deliver(now);
    }

    fn arrivals_after(&self, now: Time) -> Vec<Arrival> {
        let queue = self.0.queue.peek();
        let Some((triggers, transit)) = queue.triggers.as_ref().zip(queue.transit.as_ref()) else {
            return Vec::new();
        };
        let times = transit.arrivals_after(now);
        times.flat_map(|at| triggers.arrivals(at)).collect()
    }
}

impl<T: Payload> Queue<T> {
    /// Refuses a message that is already published.
    fn is_still_to_come(&self, seq: u64) -> Result<(), String> {
        match self.next_seq {
            next if next > seq => Err(format!(
                "message {seq} is under way already: expected {next} or more"
            )),
            _ => Ok(()),
        }
    }

    /// Sends `message`, released at run time `now`, through the link; returns when it
    /// arrives.
    #[cold]
    fn send(&mut self, message: Message<T>, now: Time) -> Option<Time> {
        let transit = self.transit.as_mut();
        let arrives = transit.and_then(|transit| transit.send(message, now));
        self.deliver(now);
        arrives
    }

    /// Delivers the messages that arrive before `now`.
    fn deliver_before(&mut self, now: Time) {
        if let Some(before) = now.as_nanos().checked_sub(1) {
            self.deliver(Time::from_nanos(before));
        }
    }

    /// Delivers the messages that arrive by `now`, in the order of arrival.
    #[cold]
    fn deliver(&mut self, now: Time) {
        let Some(mut transit) = self.transit.take() else {
            return;
        };
        while let Some((at, message)) = transit.arrived(now) {
            let overtaken = message.seq < transit.next_delivered;
            if !overtaken {
                transit.next_delivered = message.seq + 1;
                self.push(message, at);
            }
            self.send_record(|| TopicRecord::Delivered { overtaken });
        }
        self.transit = Some(transit);
    }

    /// The newest message, and what its record holds.
    fn newest(&self) -> Option<(&Message<T>, Head)> {
        let (message, arrives) = match &self.transit {
            Some(transit) => transit.newest.as_ref().map(|(m, at)| (m, *at))?,
            None => (self.messages.back()?, Some(self.newest_at)),
        };
        let marks = self.marks.iter();
        let head = Head {
            at: self.newest_at,
            stamp: message.stamp,
            seq: message.seq,
            origin: message.origin,
            arrives,
            dropped: marks.map(|mark| mark.dropped.load(Ordering::Relaxed)).sum(),
        };
        Some((message, head))
    }

    /// Sends the record of the newest message.
    #[inline]
    fn record_newest(&self) {
        let Some(records) = self.records.as_ref().filter(|records| records.are_heard()) else {
            return;
        };
        if let Some((message, head)) = self.newest() {
            let (link, payload) = (self.transit.is_some(), &message.data as &dyn Any);
            records.topic(|| TopicRecord::Sent {
                head,
                link,
                payload,
            });
        }
    }
}

impl<T> Queue<T> {
    /// Adds a message that is delivered at run time `now`.
    #[inline]
    fn push(&mut self, message: Message<T>, now: Time) {
        if self.messages.len() >= self.depth.get() {
            self.evict_oldest(now);
        }
        self.messages.push_back(message);
        if let Some(triggers) = &mut self.triggers {
            triggers.push(now);
        }
    }

    /// The message that a subscription with read position `mark` reads next.
    #[inline]
    fn to_read(&self, mark: &ReadMark) -> Option<&Message<T>> {
        match self.order {
            ReadOrder::Newest => self.messages.back(),
            ReadOrder::Oldest => {
                let unread = mark.next_unread.load(Ordering::Relaxed);
                let read = self.messages.partition_point(|m| m.seq < unread);
                self.messages.get(read).or(self.messages.back())
            }
        }
    }

    /// Evicts the oldest message at run time `now`.
    fn evict_oldest(&mut self, now: Time) {
        if let Some(evicted) = self.messages.pop_front() {
            if let Some(triggers) = &mut self.triggers {
                triggers.evict();
            }
            for mark in &self.marks {
                if mark.next_unread.load(Ordering::Relaxed) <= evicted.seq {
                    bump(&mark.dropped);
                    let (reader, at) = (mark.reader, now);
                    self.send_record(|| TopicRecord::Dropped { reader, at });
                }
            }
        }
    }

    #[inline]
    fn send_record<'a>(&self, record: impl FnOnce() -> TopicRecord<'a>) {
        if let Some(records) = &self.records {
            records.topic(record);
        }
    }
}

/// The end of a topic that a node publishes to.
///
/// ```
/// use ratelab::{Depth, Time, Topic};
///
/// let (obs, action) = (Topic::new("/obs", Depth::ONE), Topic::new("/action", Depth::ONE));
/// let (sensed, decided) = (Time::from_nanos(10), Time::from_nanos(30));
/// obs.publisher().publish(0.02, sensed, None);
///
/// // The origin of an action is the time of the reading behind it.
/// let reading = obs.subscribe().latest(decided).expect("published");
/// action.publisher().publish(-5.0 * reading.data, decided, Some(reading.sensed()));
/// assert_eq!(action.subscribe().latest(decided).expect("published").origin, Some(sensed));
/// ```
#[derive(Debug)]
pub struct Publisher<T> {
    bus: Arc<Bus<T>>,
    outbox: Option<Arc<Outbox>>,
}

impl<T: Payload> Publisher<T> {
    /// Publishes `data` at run time `stamp`. `origin` is the run time of the sensing that
    /// `data` was derived from, if any; see [`Message::sensed`].
    ///
    /// Never waits for a subscription: a full buffer evicts its oldest message. In a tick that
    /// takes time the message waits for the end of the tick, and is stamped then.
    pub fn publish(&self, data: T, stamp: Time, origin: Option<Time>) {
        match &self.outbox {
            Some(outbox) if outbox.is_needed() => self.put(outbox, data, stamp, origin),
            _ => self.bus.publish(data, stamp, stamp, origin),
        }
    }

    /// Publishes a message that arrived at run time `now` from another process, where it
    /// was published at `stamp`.
    pub fn forward(&self, data: T, now: Time, stamp: Time, origin: Option<Time>) {
        self.bus.publish(data, now, stamp, origin);
    }

    /// Publishes through the outbox, needed by few nodes.
    #[cold]
    fn put(&self, outbox: &Outbox, data: T, stamp: Time, origin: Option<Time>) {
        let (bus, began) = (self.bus.clone(), outbox.shows(stamp));
        let publish = move |now, shown| {
            let sensed = (shown != began).then_some(began);
            bus.publish(data, now, shown, origin.or(sensed));
        };
        outbox.put(stamp, Box::new(publish));
    }
}

impl<T: Payload> Bus<T> {
    /// Publishes at run time `now`, with the stamp of the publisher's clock.
    #[inline]
    fn publish(&self, data: T, now: Time, stamp: Time, origin: Option<Time>) {
        let mut turn = self.queue.lock();
        let queue = &mut *turn;
        let seq = queue.next_seq;
        queue.next_seq += 1;
        queue.newest_at = now;
        let message = Message {
            data,
            stamp,
            seq,
            origin,
        };
        let arrives = match queue.transit {
            None => {
                queue.push(message, now);
                Some(now)
            }
            Some(_) => queue.send(message, now),
        };
        if let Some((triggers, arrives)) = queue.triggers.as_ref().zip(arrives) {
            triggers.announce(arrives);
        }
        queue.record_newest();
    }
}

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
    bus: Arc<Bus<T>>,
    mark: Arc<ReadMark>,
    /// Whether its messages trigger the node, which then reads those of its set.
    triggers: bool,
}

impl<T: Payload> Subscription<T> {
    /// Returns the newest message, or `None` before the first. Older messages count as
    /// seen. `now` is the run time of reading, from which the message's age is measured.
    ///
    /// With [`ReadOrder::Oldest`] it returns the oldest unread message instead. If its
    /// messages trigger the node, it returns the one that this tick is for.
    pub fn latest(&mut self, now: Time) -> Option<Message<T>> {
        let mut turn = self.bus.queue.lock();
        let queue = &mut *turn;
        let message = if self.triggers {
            queue.triggers.as_ref()?.chosen(&self.mark)?.clone()
        } else {
            if queue.transit.is_some() {
                queue.deliver(now);
            }
            let message = queue.to_read(&self.mark)?.clone();
            let next = message.seq + 1;
            self.mark.next_unread.store(next, Ordering::Relaxed);
            message
        };
        if let Some(reader) = self.mark.reader {
            let age = now.since(message.stamp);
            queue.send_record(|| TopicRecord::Read { reader, age });
        }
        Some(message)
    }

    /// Number of messages evicted before this subscription saw them.
    pub fn dropped(&self) -> u64 {
        self.mark.dropped.load(Ordering::Relaxed)
    }

    pub(crate) fn mark(&self) -> Arc<ReadMark> {
        self.mark.clone()
    }
}

impl<T> Drop for Subscription<T> {
    fn drop(&mut self) {
        self.bus
            .queue
            .lock()
            .marks
            .retain(|mark| !Arc::ptr_eq(mark, &self.mark));
    }
}

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
//! | a tap is full, real clock | the publisher goes on; the tap counts what it lost |
//! | a tap is full, virtual clock | run time waits for the tap, nothing is lost |
//!
//! Each row is a test in `tests/library/topic.rs`.

mod intake;

use std::{collections::VecDeque, fmt, time::Duration};

use self::intake::Triggers;

use super::{
    channel::Channel,
    depth::Depth,
    link::Link,
    message::{Message, Payload},
    outbox::Outbox,
    read_order::ReadOrder,
    reexecution::Shared,
    sync::{Arc, atomic::Ordering, bump},
    tap::{Backpressure, Tap, TapMessage, TapSender, tap},
    telemetry::{Flight, Meter, MeterRecorder, ReadMark, TopicCounters},
    time::Time,
    transit::Transit,
};

/// A named, bounded, thread-safe, latest-wins bus.
///
/// Clones are handles to the same bus. Nodes do not hold a topic: they hold an end of it,
/// a [`Publisher`] or a [`Subscription`], which they receive from the
/// [`Graph`](super::Graph).
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
    counters: Arc<TopicCounters>,
    queue: Shared<Queue<T>>,
}

#[derive(Debug)]
struct Queue<T> {
    messages: VecDeque<Message<T>>,
    depth: Depth,
    next_seq: u64,
    order: ReadOrder,
    /// Messages in flight, once the topic has had a link.
    transit: Option<Box<Transit<T>>>,
    /// What the nodes need that its messages trigger, if there are any.
    triggers: Option<Box<Triggers<T>>>,
    marks: Vec<Arc<ReadMark>>,
    taps: Vec<TapSender<TapMessage<T>>>,
    watcher: Option<MessageWatcher<T>>,
}

/// A function of the run time and the payload of a message.
type Watch<T> = dyn FnMut(Time, &T) + Send;

/// Inspects each message when it is published.
struct MessageWatcher<T>(Box<Watch<T>>);

impl<T> fmt::Debug for MessageWatcher<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Watcher")
    }
}

impl<T> Clone for Topic<T> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

impl<T: Payload> Topic<T> {
    /// Creates a separate bus. A [`Graph`](super::Graph) checks that names are unique.
    pub fn new(name: impl Into<String>, depth: Depth) -> Self {
        let queue = Queue {
            messages: VecDeque::new(),
            depth,
            next_seq: 0,
            order: ReadOrder::Newest,
            transit: None,
            triggers: None,
            marks: Vec::new(),
            taps: Vec::new(),
            watcher: None,
        };
        Self(Arc::new(Bus {
            counters: Arc::new(TopicCounters::new(depth)),
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
        let mark = Arc::new(ReadMark::default());
        let queue = self.0.queue.aside();
        let transit = queue.transit.as_ref();
        let next = transit.map_or(queue.next_seq, |transit| transit.next_delivered);
        drop(queue);
        mark.next_unread.store(next, Ordering::Relaxed);
        let (_, age_meter) = Meter::new();
        self.subscribe_again(mark, age_meter)
    }

    /// Creates a subscription with the read position `mark` and the meter `age_meter` of
    /// a previous one.
    pub(crate) fn subscribe_again(&self, mark: Arc<ReadMark>, age_meter: Meter) -> Subscription<T> {
        let mut queue = self.0.queue.lock();
        queue.marks.push(mark.clone());
        let triggers = queue.triggers.as_ref();
        Subscription {
            bus: self.0.clone(),
            triggers: triggers.is_some_and(|triggers| triggers.knows(&mark)),
            mark,
            ages: age_meter.recorder(),
            age_meter,
        }
    }

    /// Creates a queue of `capacity` messages that receives a copy of every message from
    /// now on, for logs, recorders and tests.
    pub fn tap(&self, capacity: usize, backpressure: Backpressure) -> Tap<TapMessage<T>> {
        let (end, tap) = tap(capacity, backpressure);
        self.0.queue.aside().taps.push(end);
        tap
    }

    /// Calls `watcher` with every message from now on, when it is published.
    pub(crate) fn set_watcher(&self, watcher: impl FnMut(Time, &T) + Send + 'static) {
        self.0.queue.aside().watcher = Some(MessageWatcher(Box::new(watcher)));
    }

    /// Changes the queue depth at run time `now`. Messages that no longer fit are
    /// evicted, oldest first, and counted as dropped by every subscription that had not
    /// seen them. Returns the previous depth.
    pub fn set_depth(&self, depth: Depth, now: Time) -> Depth {
        let mut turn = self.0.queue.lock();
        let queue = &mut *turn;
        queue.deliver_before(now, &self.0.counters);
        let before = std::mem::replace(&mut queue.depth, depth);
        while queue.messages.len() > queue.depth.get() {
            queue.evict_oldest(now);
        }
        self.0.counters.depth.store(depth.get(), Ordering::Relaxed);
        before
    }

    /// The newest message as a tap would see it, read without a subscription; `None`
    /// before the first.
    pub(crate) fn peek(&self) -> Option<TapMessage<T>> {
        let at = self.0.counters.newest()?;
        self.0.queue.aside().newest(at)
    }

    /// Changes the read order of subscriptions. Returns the previous order.
    pub(crate) fn set_order(&self, order: ReadOrder) -> ReadOrder {
        std::mem::replace(&mut self.0.queue.lock().order, order)
    }

    /// Sets a link for messages released from run time `now` on; returns the previous
    /// link.
    pub(crate) fn set_link(&self, link: Link, seed: u64, now: Time) -> Link {
        let mut turn = self.0.queue.lock();
        let queue = &mut *turn;
        let perfect = link == Link::NONE;
        if perfect && queue.transit.is_none() {
            return link;
        }
        queue.deliver_before(now, &self.0.counters);
        let before = queue.channel(self.name(), seed).set_link(link);
        // A topic without a link is as fast as one that never had a link.
        queue
            .transit
            .take_if(|transit| perfect && transit.is_done());
        before
    }

    /// Loses message number `seq` on the link.
    ///
    /// # Errors
    /// If it is already published.
    pub(crate) fn lose(&self, seq: u64, seed: u64) -> Result<(), String> {
        let mut turn = self.0.queue.lock();
        let queue = &mut *turn;
        queue.is_still_to_come(seq)?;
        queue.channel(self.name(), seed).lose(seq);
        Ok(())
    }

    /// Sets an extra `delay` for message number `seq`; returns the previous one.
    ///
    /// # Errors
    /// If it is already published.
    pub(crate) fn postpone(
        &self,
        seq: u64,
        delay: Duration,
        seed: u64,
    ) -> Result<Duration, String> {
        let mut turn = self.0.queue.lock();
        let queue = &mut *turn;
        queue.is_still_to_come(seq)?;
        Ok(queue.channel(self.name(), seed).postpone(seq, delay))
    }

    /// Delivers the messages that arrive by `now`. Publishing and reading do the same.
    pub(crate) fn deliver(&self, now: Time) {
        self.0.queue.aside().deliver(now, &self.0.counters);
    }

    /// Queue depth.
    pub fn depth(&self) -> Depth {
        Depth::known(self.0.counters.depth.load(Ordering::Relaxed))
    }

    /// Number of messages published so far.
    pub fn published(&self) -> u64 {
        self.0.counters.published.load(Ordering::Relaxed)
    }

    /// Messages per second over the second before `now`.
    pub fn rate(&self, now: Time) -> f64 {
        self.0.counters.window.per_second(now)
    }

    pub(crate) fn counters(&self) -> Arc<TopicCounters> {
        self.0.counters.clone()
    }
}

impl<T: Payload> Queue<T> {
    /// Sends every tap a copy of the message published at run time `at`, and removes
    /// closed taps.
    fn offer_newest(&mut self, at: Time) {
        if !self.taps.is_empty()
            && let Some(newest) = self.newest(at)
        {
            self.taps.retain(|tap| tap.offer(newest.clone()));
        }
    }

    /// What decides when messages are delivered.
    fn channel(&mut self, topic: &str, seed: u64) -> &mut Channel {
        let (next, newest) = (self.next_seq, self.messages.back());
        let transit = self.transit.get_or_insert_with(|| {
            let channel = Channel::new(seed, topic);
            Box::new(Transit::new(channel, next, newest.cloned()))
        });
        &mut transit.channel
    }

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
    fn send(&mut self, message: Message<T>, now: Time, counters: &TopicCounters) -> Option<Time> {
        let transit = self.transit.as_mut();
        let arrives = transit.and_then(|transit| transit.send(message, now));
        counters.fly(Flight {
            released: now,
            arrives,
        });
        self.deliver(now, counters);
        arrives
    }

    /// Delivers the messages that arrive before `now`.
    fn deliver_before(&mut self, now: Time, counters: &TopicCounters) {
        if let Some(before) = now.as_nanos().checked_sub(1) {
            self.deliver(Time::from_nanos(before), counters);
        }
    }

    /// Delivers the messages that arrive by `now`, in the order of arrival.
    #[cold]
    fn deliver(&mut self, now: Time, counters: &TopicCounters) {
        let Some(mut transit) = self.transit.take() else {
            return;
        };
        while let Some((at, message)) = transit.arrived(now) {
            bump(&counters.delivered);
            if message.seq < transit.next_delivered {
                bump(&counters.overtaken);
                continue;
            }
            transit.next_delivered = message.seq + 1;
            self.push(message, at);
        }
        let in_flight = transit.in_flight() as u64;
        counters.in_flight.store(in_flight, Ordering::Relaxed);
        self.transit = Some(transit);
    }

    /// The newest message, published at run time `at`, and the number of losses so far.
    fn newest(&self, at: Time) -> Option<TapMessage<T>> {
        let (message, arrives) = match &self.transit {
            Some(transit) => transit.newest.clone()?,
            None => (self.messages.back()?.clone(), Some(at)),
        };
        let marks = self.marks.iter();
        let dropped = marks.map(|mark| mark.dropped.load(Ordering::Relaxed)).sum();
        Some(TapMessage {
            message,
            at,
            arrives,
            dropped,
        })
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
                    mark.drops.count(now);
                }
            }
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
    /// Never waits for a subscription: a full buffer evicts its oldest message. A full
    /// [`Tap`] blocks under the virtual clock only. In a tick that takes time the message
    /// waits for the end of the tick, and is stamped then.
    pub fn publish(&self, data: T, stamp: Time, origin: Option<Time>) {
        match &self.outbox {
            Some(outbox) if outbox.is_needed() => self.put(outbox, data, stamp, origin),
            _ => self.bus.publish(data, stamp, stamp, origin),
        }
    }

    /// Publishes a message that arrived at run time `now` from another process, where it
    /// was published at `stamp`.
    pub(crate) fn forward(&self, data: T, now: Time, stamp: Time, origin: Option<Time>) {
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
        if let Some(MessageWatcher(watch)) = &mut queue.watcher {
            watch(now, &data);
        }
        let seq = queue.next_seq;
        queue.next_seq += 1;
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
            Some(_) => queue.send(message, now, &self.counters),
        };
        if let Some((triggers, arrives)) = queue.triggers.as_ref().zip(arrives) {
            triggers.announce(arrives);
        }
        queue.offer_newest(now);
        bump(&self.counters.published);
        self.counters.note(now);
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
    ages: MeterRecorder,
    age_meter: Meter,
}

impl<T: Payload> Subscription<T> {
    /// Returns the newest message, or `None` before the first. Older messages count as
    /// seen. `now` is the run time of reading, from which the message's age is measured.
    ///
    /// With [`ReadOrder::Oldest`] it returns the oldest unread message instead. If its
    /// messages trigger the node, it returns the one that this tick is for.
    pub fn latest(&mut self, now: Time) -> Option<Message<T>> {
        let message = {
            let mut turn = self.bus.queue.lock();
            let queue = &mut *turn;
            if self.triggers {
                let chosen = queue.triggers.as_ref()?.chosen(&self.mark)?.clone();
                self.ages.record(now.since(chosen.stamp));
                return Some(chosen);
            }
            if queue.transit.is_some() {
                queue.deliver(now, &self.bus.counters);
            }
            let message = queue.to_read(&self.mark)?.clone();
            self.mark
                .next_unread
                .store(message.seq + 1, Ordering::Relaxed);
            message
        };
        self.ages.record(now.since(message.stamp));
        Some(message)
    }

    /// Number of messages evicted before this subscription saw them.
    pub fn dropped(&self) -> u64 {
        self.mark.dropped.load(Ordering::Relaxed)
    }

    /// Ages of messages when this subscription read them.
    pub fn ages(&self) -> Meter {
        self.age_meter.clone()
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

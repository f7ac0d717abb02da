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
//! | `read()` on a topic that never carried a message | `None` |
//! | `read()` | the newest message; everything older counts as seen |
//! | `read()` again with nothing new | the same message again (zero-order hold), no drop |
//! | `read_next()` | the oldest unread message; none if all are read |
//! | two subscriptions, one slow | only the slow one counts drops |
//! | subscribing late | `read()` gives the newest message; earlier ones never count as drops |
//! | depth 0 | refused: [`DepthError`] |
//! | queue made shallower while running | the oldest go; unread ones count as dropped |
//! | queue made deeper while running | nothing is lost, nothing returns |
//! | read order oldest | the oldest unread message; the last one again if there is none |
//! | the topic triggers the reader | the message that the tick is for, whatever the read order |
//! | a link | messages enter the queue on delivery; drops and reads happen there |
//!
//! Each row is tested: the first ones in `tests.rs` here, read order and links in
//! `tests/library/links.rs`, triggers in `tests/library/graph_executors.rs`.

mod ends;
mod intake;
mod link_channel;
mod message;
mod queue;
#[cfg(test)]
mod tests;

pub use ends::{ForwardedTimes, Publisher, Subscription};
pub(crate) use intake::{Intake, TakenMessage};
pub(crate) use message::SourceRank;
pub use message::{Cause, Message, Payload};
pub(crate) use queue::Publication;

use crate::{
    arrival::Arrival,
    control::{command::KnobRefusal, knob::Knob},
    qos::Depth,
    record::{Head, RecordSender, TopicRecord},
    sync::Arc,
    time::Time,
};
use link_channel::{LinkChannel, Transit};
use queue::{Bus, Queue};

/// A named, bounded, thread-safe, latest-wins bus.
///
/// Clones are handles to the same bus. Nodes do not hold a topic: they hold an end of it,
/// a [`Publisher`] or a [`Subscription`], which they receive from the
/// [`Graph`](crate::Graph).
///
/// ```
/// use ratelab::{Depth, Tick, Time, Topic};
///
/// let topic = Topic::new("/range", Depth::ONE);
/// let publisher = topic.publisher();
/// let mut subscription = topic.subscribe();
///
/// Tick::at(Time::from_nanos(1)).publish(&publisher, 1.7);
/// Tick::at(Time::from_nanos(2)).publish(&publisher, 1.6);
///
/// let newest = Tick::at(Time::from_nanos(3)).read(&mut subscription).expect("published");
/// assert_eq!(newest.data, 1.6);
/// assert_eq!(subscription.dropped(), 1); // 1.7 was lost unread
/// ```
#[derive(Debug)]
pub struct Topic<T>(Arc<Bus<T>>);

impl<T> Clone for Topic<T> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

impl<T: Payload> Topic<T> {
    /// Creates a separate bus. A [`Graph`](crate::Graph) checks that names are unique.
    pub fn new(name: impl Into<String>, depth: Depth) -> Self {
        Self(Arc::new(Bus::new(name.into(), Queue::new(depth))))
    }

    /// The topic's name, such as `/obs`.
    pub fn name(&self) -> &str {
        self.0.name()
    }

    /// Creates a publishing end.
    pub fn publisher(&self) -> Publisher<T> {
        Publisher {
            bus: self.0.clone(),
        }
    }

    /// Creates a reading end with its own read position and drop count. It can read the
    /// newest earlier message, but earlier messages never count as dropped.
    pub fn subscribe(&self) -> Subscription<T> {
        self.subscribe_as(None)
    }

    /// Creates the reading end of a node, at this place among the readers of the topic, or one outside
    /// of a graph.
    pub(crate) fn subscribe_as(&self, place: Option<usize>) -> Subscription<T> {
        let reader = self.0.lock().add_reader(place);
        let bus = self.0.clone();
        Subscription { bus, reader }
    }

    /// Creates a subscription with the `reader` of a previous one, and so its read position.
    pub(crate) fn subscribe_again(&self, reader: usize) -> Subscription<T> {
        self.0.lock().readers[reader].is_open = true;
        let bus = self.0.clone();
        Subscription { bus, reader }
    }

    /// Its index in the graph; `None` outside of one.
    pub fn index(&self) -> Option<usize> {
        let queue = self.0.peek();
        queue.records.as_ref().map(RecordSender::index)
    }

    /// The number of its bus, the same for each handle to it.
    pub(crate) fn address(&self) -> usize {
        Arc::as_ptr(&self.0).addr()
    }

    /// Changes the queue depth at run time `now`. Messages that no longer fit are
    /// evicted, oldest first, and counted as dropped by every subscription that had not
    /// seen them. Returns the previous depth.
    pub fn set_depth(&self, depth: Depth, now: Time) -> Depth {
        let mut bus = self.0.lock();
        let queue = &mut *bus;
        queue.deliver_before(now);
        let before = std::mem::replace(&mut queue.depth, depth);
        while queue.messages.len() > queue.depth.get() {
            queue.evict_oldest(now);
        }
        queue.send_record(|| TopicRecord::Depth(depth));
        before
    }

    /// The newest published message, even if it is in flight or lost, with what a record of it would
    /// hold; `None` before the first.
    pub fn peek(&self) -> Option<(T, Head)> {
        let queue = self.0.peek();
        let (message, head) = queue.newest()?;
        Some((message.data.clone(), head))
    }

    /// Queue depth.
    pub fn depth(&self) -> Depth {
        self.0.peek().depth
    }

    /// Number of messages published so far.
    pub fn published(&self) -> u64 {
        self.0.peek().next_seq
    }
}

/// A topic, regardless of its payload.
pub(crate) trait AnyTopic: Send {
    /// Sets a knob of the topic, or of its link in a run with this `seed`, for messages published
    /// from run time `now` on; returns the knob that was in force.
    ///
    /// # Errors
    /// [`KnobRefusal`] for a message that is published already, and for a knob of a node.
    fn set(&self, knob: &Knob, seed: u64, now: Time) -> Result<Knob, KnobRefusal>;

    /// Queue depth.
    fn depth(&self) -> Depth;

    /// Sends its records on this way.
    /// Returns whether a graph has it already.
    fn is_in_graph(&self) -> bool;

    fn set_records(&self, records: RecordSender);

    /// Delivers the messages that arrive by `now`. Publishing and reading do the same.
    fn deliver(&self, now: Time);

    /// Returns the messages in flight that arrive after `now`, for the nodes that they trigger.
    fn arrivals_after(&self, now: Time) -> Vec<Arrival>;
}

impl<T: Payload> AnyTopic for Topic<T> {
    fn set(&self, knob: &Knob, seed: u64, now: Time) -> Result<Knob, KnobRefusal> {
        match knob {
            Knob::Depth { topic, depth } => {
                return Ok(Knob::Depth {
                    topic: topic.clone(),
                    depth: self.set_depth(*depth, now),
                });
            }
            Knob::Read { topic, order } => {
                return Ok(Knob::Read {
                    topic: topic.clone(),
                    order: std::mem::replace(&mut self.0.lock().order, *order),
                });
            }
            _ => {}
        }
        let mut bus = self.0.lock();
        let queue = &mut *bus;
        match knob.message() {
            Some(seq) => queue.ensure_unpublished(seq)?,
            None => queue.deliver_before(now),
        }
        let transit = match &mut queue.transit {
            Some(transit) => transit,
            none => {
                let channel = LinkChannel::new(seed, self.name());
                let newest = queue.messages.back().cloned();
                none.insert(Box::new(Transit::new(channel, queue.next_seq, newest)))
            }
        };
        let before = transit.channel.set(knob);
        // Without a link, and with nothing in flight, it is as fast as a topic that never had one.
        queue.transit.take_if(|transit| transit.is_done());
        before
    }

    fn depth(&self) -> Depth {
        Topic::depth(self)
    }

    fn is_in_graph(&self) -> bool {
        self.index().is_some()
    }

    fn set_records(&self, records: RecordSender) {
        self.0.peek().records = Some(records);
    }

    fn deliver(&self, now: Time) {
        self.0.peek().deliver(now);
    }

    fn arrivals_after(&self, now: Time) -> Vec<Arrival> {
        let queue = self.0.peek();
        let Some(transit) = &queue.transit else {
            return Vec::new();
        };
        let times = transit.arrivals_after(now);
        times.flat_map(|at| queue.arrivals(at)).collect()
    }
}

//! What a node gets for a tick: the time, its reads, and its messages.

use std::{fmt, time::Duration};

use crate::{
    record::{Derived, NodeRecord, Push, RecordSender, TickId},
    settings::local_clock::StampClock,
    sync::Arc,
    time::Time,
    topic::{Cause, Message, Payload, Publication, Publisher, SourceRank, Subscription},
};

/// One tick of a node: what it reads and publishes passes through here, so that every message knows
/// what it was derived from.
///
/// ```
/// use ratelab::{Depth, Tick, Time, Topic};
///
/// let (obs, action) = (Topic::new("/obs", Depth::ONE), Topic::new("/action", Depth::ONE));
/// let (mut readings, mut decisions) = (obs.subscribe(), action.subscribe());
/// Tick::at(Time::from_nanos(10)).publish(&obs.publisher(), 0.02);
///
/// // The action is as old as the reading behind it.
/// let mut policy = Tick::at(Time::from_nanos(30));
/// let reading = policy.read(&mut readings).expect("published");
/// policy.publish(&action.publisher(), -5.0 * reading.data);
///
/// let mut actuator = Tick::at(Time::from_nanos(30));
/// let action = actuator.read(&mut decisions).expect("published");
/// assert_eq!(action.sensed(), Time::from_nanos(10));
/// assert_eq!(actuator.age().expect("it read").as_nanos(), 20);
/// ```
pub struct Tick {
    now: Time,
    /// `None` outside of a graph.
    id: Option<TickId>,
    source: SourceRank,
    /// What the node read last with each of its subscriptions, in this tick or before.
    reads: Vec<LastRead>,
    /// Whether the work is done, and only the effect on the world is left.
    is_over: bool,
    /// What the node does to the world at the end.
    effect: Option<Effect>,
    /// The messages that wait for the end of a tick that takes time.
    held: Vec<Held>,
    /// Whether messages wait.
    holds: bool,
    clock: Arc<StampClock>,
    records: RecordSender,
}

/// Publishes a message at a run time, with a stamp.
type Held = Box<dyn FnOnce(Time, Time) + Send>;

/// What a node read last with a subscription.
#[derive(Clone, Copy)]
struct LastRead {
    /// The number of the subscription's bus, and the index of its reader there.
    key: (usize, usize),
    cause: Cause,
    /// Number of the tick.
    tick: u64,
    /// Whether the node reads every message, and so several in a tick.
    reads_all: bool,
}

/// An effect on the world.
#[derive(Clone, Copy)]
enum Effect {
    /// By what the node has read.
    ByReads,
    /// By a sensing at this run time.
    On(Time),
}

impl Tick {
    /// Returns a tick at run time `now` outside of a graph: for tests, and for whoever publishes to
    /// a running graph or reads from it.
    pub fn at(now: Time) -> Self {
        Self {
            now,
            id: None,
            source: SourceRank::UNKNOWN,
            reads: Vec::new(),
            is_over: false,
            effect: None,
            held: Vec::new(),
            holds: false,
            clock: Arc::default(),
            records: RecordSender::default(),
        }
    }

    /// For the ticks of a node of a graph, one after the other.
    pub(crate) fn for_node(records: RecordSender, clock: Arc<StampClock>, reads: bool) -> Self {
        let node = records.index();
        Self {
            source: SourceRank::new(node, reads),
            clock,
            records,
            ..Self::at(Time::ZERO)
        }
    }

    /// Begins the next tick, which may hold its messages back until it ends.
    #[inline]
    pub(crate) fn begin(&mut self, now: Time, holds: bool) {
        let number = self.id.map_or(0, |last| last.number + 1);
        let node = self.records.index();
        self.id = Some(TickId { node, number });
        self.now = now;
        self.is_over = false;
        self.holds = holds;
        self.effect = None;
    }

    /// Ends its work: what is left is the effect on the world.
    #[inline]
    pub(crate) fn end(&mut self, now: Time) {
        self.now = now;
        self.is_over = true;
        self.publish_held();
        if let Some(effect) = self.effect.take() {
            self.record_effect(effect);
        }
    }

    fn publish_held(&mut self) {
        self.holds = false;
        if self.held.is_empty() {
            return;
        }
        let (now, stamp) = (self.now, self.stamp());
        for message in self.held.drain(..) {
            message(now, stamp);
        }
    }

    /// Forgets the messages that it holds back.
    pub(crate) fn abort(&mut self) {
        self.held.clear();
        self.holds = false;
    }

    /// Forgets what the node has read, as a program does that is started again.
    pub(crate) fn forget_reads(&mut self) {
        self.reads.clear();
    }

    /// Returns its number, counted from zero.
    #[inline]
    pub fn number(&self) -> u64 {
        self.id.map_or(0, |id| id.number)
    }

    /// Returns the run time: the start of the tick; in [`Node::apply`](crate::Node::apply) its end.
    #[inline]
    pub fn now(&self) -> Time {
        self.now
    }

    /// Returns what the node's own clock shows now, by which its messages are stamped.
    #[inline]
    pub fn stamp(&self) -> Time {
        self.clock.shows(self.now)
    }

    /// Reads the newest message, or `None` before the first. Older messages count as seen.
    ///
    /// With [`ReadOrder::Oldest`](crate::ReadOrder::Oldest) it reads the oldest unread message
    /// instead. If its messages trigger the node, it reads the one that this tick is for.
    ///
    /// Reads belong into [`Node::tick`](crate::Node::tick): what a node reads in
    /// [`Node::apply`](crate::Node::apply) may have come after its tick began.
    #[inline]
    pub fn read<T: Payload>(&mut self, from: &mut Subscription<T>) -> Option<Message<T>> {
        let message = from.read(self.now, self.number())?;
        self.add_read(from.key(), message.cause(), false);
        Some(message)
    }

    /// Reads the oldest message that this subscription has not seen, or `None` if it has seen all:
    /// for nodes that need every message, in the order of delivery. If its messages trigger the
    /// node, it reads the one that this tick is for, once.
    pub fn read_next<T: Payload>(&mut self, from: &mut Subscription<T>) -> Option<Message<T>> {
        let message = from.next_unseen(self.now, self.number())?;
        self.add_read(from.key(), message.cause(), true);
        Some(message)
    }

    #[inline]
    fn add_read(&mut self, key: (usize, usize), cause: Cause, reads_all: bool) {
        let read = LastRead {
            key,
            cause,
            tick: self.number(),
            reads_all,
        };
        match self.reads.iter_mut().find(|last| last.key == key) {
            Some(last) => *last = read,
            None => self.reads.push(read),
        }
    }

    /// Publishes `data`, derived from what the node has read. A node that reads nothing begins data.
    ///
    /// Never waits for a subscription: a full buffer evicts its oldest message. In a tick that takes
    /// time the message waits for the end of the tick, and is stamped then.
    #[inline]
    pub fn publish<T: Payload>(&mut self, to: &Publisher<T>, data: T) {
        let publication = self.publication(self.behind());
        self.send(to, data, publication);
    }

    /// Publishes `data`, derived from this one message of all that the node has read.
    pub fn publish_from<T: Payload>(
        &mut self,
        to: &Publisher<T>,
        data: T,
        cause: impl Into<Cause>,
    ) {
        let Cause {
            message,
            sensed,
            source,
        } = cause.into();
        let publication = Publication {
            origin: Some(sensed),
            source,
            from: message.map_or(Derived::Reads, Derived::Message),
            ..self.publication(None)
        };
        self.send(to, data, publication);
    }

    /// Publishes data that begin with this tick, whatever the node has read: as a node does that senses
    /// the world, or reports its own state.
    pub fn publish_new<T: Payload>(&mut self, to: &Publisher<T>, data: T) {
        let publication = self.publication(None);
        self.send(to, data, publication);
    }

    /// Publishes data that begin with this tick at once, whatever the tick takes; stamped by the run
    /// time, not by a wrong clock of the node.
    pub fn publish_at_once<T: Payload>(&self, to: &Publisher<T>, data: T) {
        let publication = Publication {
            stamp: self.now,
            ..self.publication(None)
        };
        to.send(data, publication);
    }

    /// Publishes `data` with this header stamp, as a node does that copies one; without a stamp they
    /// begin with this tick.
    pub fn publish_stamped<T: Payload>(
        &mut self,
        to: &Publisher<T>,
        data: T,
        stamp: impl Into<Option<Time>>,
    ) {
        let publication = match stamp.into() {
            None => self.publication(None),
            origin => Publication {
                origin,
                ..self.publication(self.behind())
            },
        };
        self.send(to, data, publication);
    }

    /// Returns what a message is derived from that has the data of this read.
    fn derived(&self, behind: Option<&LastRead>) -> Derived {
        match behind {
            // What else this tick reads comes later.
            Some(read) if read.reads_all || read.tick != self.number() => {
                (read.cause.message).map_or(Derived::Reads, Derived::Message)
            }
            None if self.source.is_reader() => Derived::Nothing,
            _ => Derived::Reads,
        }
    }

    #[inline]
    fn send<T: Payload>(&mut self, to: &Publisher<T>, data: T, publication: Publication) {
        if self.holds {
            self.held.push(Box::new(to.held(data, publication)));
        } else {
            to.send(data, publication);
        }
    }

    /// Returns a message that is published now with the data of this read; without one its data
    /// begin with this tick.
    #[inline]
    fn publication(&self, behind: Option<&LastRead>) -> Publication {
        Publication {
            at: self.now,
            stamp: self.stamp(),
            origin: behind.map(|read| read.cause.sensed),
            source: behind.map_or(self.source, |read| read.cause.source),
            by: self.id,
            from: self.derived(behind),
        }
    }

    /// Returns the newest data that the node has read; `None` before it has read any. Of several
    /// sources the first node counts.
    #[inline]
    fn behind(&self) -> Option<&LastRead> {
        self.reads.iter().reduce(|known, read| {
            if read.cause.is_before(&known.cause) {
                read
            } else {
                known
            }
        })
    }

    /// Returns the age of the newest data that the node has read; `None` before it has read any.
    pub fn age(&self) -> Option<Duration> {
        Some(self.now.since(self.behind()?.cause.sensed))
    }

    /// Records that the node acts on the world by what it has read. Nothing is recorded before it has
    /// read anything.
    ///
    /// The action counts from the end of the tick, wherever this is called: so its age has all that
    /// the tick [takes](crate::Knob::Takes). The node's own work under the real clock is not a part of it:
    /// a tick without such a cost is over as it begins.
    pub fn act(&mut self) {
        self.do_at_end(Effect::ByReads);
    }

    /// Records that the node acts on the world by a sensing at run time `sensed`, where the node
    /// knows it.
    pub fn act_on(&mut self, sensed: Time) {
        self.do_at_end(Effect::On(sensed));
    }

    fn do_at_end(&mut self, effect: Effect) {
        if self.is_over {
            self.record_effect(effect);
        } else {
            self.effect = Some(effect);
        }
    }

    fn record_effect(&self, effect: Effect) {
        let sensed = match effect {
            Effect::ByReads => self.behind().map(|read| read.cause.sensed),
            Effect::On(sensed) => Some(sensed),
        };
        if let Some(sensed) = sensed {
            let at = self.now;
            self.records
                .node(|| NodeRecord::Pushed(Push { at, sensed }));
        }
    }
}

impl fmt::Debug for Tick {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (id, now) = (self.id, self.now);
        write!(f, "Tick({id:?} at {now})")
    }
}

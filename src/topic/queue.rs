//! The messages of a topic, and who has read how far.

use std::{any::Any, collections::VecDeque};

use super::{
    link_channel::Transit,
    message::{Message, Payload, SourceRank},
};
use crate::{
    arrival::{Arrival, Arrivals},
    control::command::KnobRefusal,
    qos::{Depth, ReadOrder},
    record::{Derived, Head, RecordSender, TickId, TopicRecord},
    shared::Shared,
    sync::Arc,
    time::Time,
};

/// When a message is published, and by whom.
#[derive(Clone, Copy)]
pub(crate) struct Publication {
    /// Run time.
    pub(crate) at: Time,
    /// That time as the clock of the publisher shows it.
    pub(crate) stamp: Time,
    /// Run time of the sensing behind it, if known.
    pub(crate) origin: Option<Time>,
    /// The node whose data it has.
    pub(crate) source: SourceRank,
    /// The tick of a node that publishes it.
    pub(crate) by: Option<TickId>,
    /// What it was derived from.
    pub(crate) from: Derived,
}

/// What the handles of a topic and its ends share.
pub(super) type Bus<T> = Shared<Queue<T>>;

/// The messages of a topic.
pub(super) struct Queue<T> {
    /// The messages that can be read, each with the run time of its delivery.
    pub(super) messages: VecDeque<(Message<T>, Time)>,
    pub(super) depth: Depth,
    pub(super) next_seq: u64,
    /// Run time of the newest publication.
    pub(super) newest_at: Time,
    /// The tick that published it, and what it was derived from.
    newest_by: Option<TickId>,
    newest_from: Derived,
    pub(super) order: ReadOrder,
    /// Messages in flight, while the topic has a link.
    pub(super) transit: Option<Box<Transit<T>>>,
    /// Whether its messages trigger a node.
    pub(super) has_triggers: bool,
    pub(super) readers: Vec<TopicReader<T>>,
    /// Where its records go, once it is in a graph.
    pub(super) records: Option<RecordSender>,
}

impl<T: Payload> Queue<T> {
    /// Creates an empty one.
    pub(super) fn new(depth: Depth) -> Self {
        Self {
            messages: VecDeque::new(),
            depth,
            next_seq: 0,
            newest_at: Time::ZERO,
            newest_by: None,
            newest_from: Derived::Reads,
            order: ReadOrder::Newest,
            transit: None,
            has_triggers: false,
            readers: Vec::new(),
            records: None,
        }
    }

    /// Adds a reader: at `place` among the readers of a graph's topic, or outside of a graph (`None`);
    /// returns its index. The reader has seen all that is delivered.
    pub(super) fn add_reader(&mut self, place: Option<usize>) -> usize {
        let next = (self.transit.as_ref()).map_or(self.next_seq, |transit| transit.next_delivered);
        let reader = TopicReader::new(next, place);
        let mut known = self.readers.iter();
        // Nobody comes back to one outside of a graph.
        match known.position(|known| !known.is_open && known.place.is_none()) {
            Some(free) => {
                self.readers[free] = reader;
                free
            }
            None => {
                self.readers.push(reader);
                self.readers.len() - 1
            }
        }
    }

    /// Publishes a message; returns its sequence number.
    #[inline]
    pub(super) fn publish(&mut self, data: T, publication: Publication) -> u64 {
        let Publication {
            at: now,
            stamp,
            origin,
            source,
            by,
            from,
        } = publication;
        let seq = self.next_seq;
        self.next_seq += 1;
        (self.newest_at, self.newest_by, self.newest_from) = (now, by, from);
        let message = Message {
            data,
            stamp,
            seq,
            origin,
            source,
            topic: self
                .records
                .as_ref()
                .map_or(u32::MAX, |it| it.index() as u32),
        };
        let arrives = match self.transit {
            None => {
                self.push(message, now);
                Some(now)
            }
            Some(_) => self.send(message, now),
        };
        if let Some(arrives) = arrives.filter(|_| self.has_triggers) {
            self.announce(arrives);
        }
        self.record_newest();
        seq
    }

    /// Refuses a message that is already published.
    pub(super) fn ensure_unpublished(&self, seq: u64) -> Result<(), KnobRefusal> {
        let next = self.next_seq;
        if next > seq {
            Err(KnobRefusal::UnderWay { seq, next })
        } else {
            Ok(())
        }
    }

    /// Sends `message`, published at run time `now`, through the link; returns when it
    /// arrives.
    #[cold]
    pub(super) fn send(&mut self, message: Message<T>, now: Time) -> Option<Time> {
        let transit = self.transit.as_mut();
        let arrives = transit.and_then(|transit| transit.send(message, now));
        self.deliver(now);
        arrives
    }

    /// Delivers the messages that arrive before `now`.
    pub(super) fn deliver_before(&mut self, now: Time) {
        if let Some(before) = now.as_nanos().checked_sub(1) {
            self.deliver(Time::from_nanos(before));
        }
    }

    /// Delivers the messages that arrive by `now`, in the order of arrival.
    #[cold]
    pub(super) fn deliver(&mut self, now: Time) {
        let Some(mut transit) = self.transit.take() else {
            return;
        };
        while let Some((at, message)) = transit.arrived(now) {
            let seq = message.seq;
            let overtaken = seq < transit.next_delivered;
            if !overtaken {
                transit.next_delivered = seq + 1;
                self.push(message, at);
            }
            self.send_record(|| TopicRecord::Delivered { seq, at, overtaken });
        }
        self.transit = Some(transit);
    }

    /// Returns the newest message, and what its record holds.
    pub(super) fn newest(&self) -> Option<(&Message<T>, Head)> {
        let (message, arrives) = match &self.transit {
            Some(transit) => transit.newest.as_ref().map(|(m, at)| (m, *at))?,
            None => (&self.messages.back()?.0, Some(self.newest_at)),
        };
        // What a node has lost stays lost when it is gone.
        let counts = |reader: &&TopicReader<T>| reader.is_open || reader.place.is_some();
        let readers = self.readers.iter().filter(counts);
        let head = Head {
            at: self.newest_at,
            by: self.newest_by,
            stamp: message.stamp,
            seq: message.seq,
            origin: message.origin,
            from: self.newest_from,
            arrives,
            dropped: readers.map(|reader| reader.dropped).sum(),
        };
        Some((message, head))
    }

    /// Sends the record of the newest message.
    #[inline]
    pub(super) fn record_newest(&self) {
        let Some(records) = self.records.as_ref().filter(|records| records.is_heard()) else {
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
    pub(super) fn push(&mut self, message: Message<T>, now: Time) {
        if self.messages.len() >= self.depth.get() {
            self.evict_oldest(now);
        }
        self.messages.push_back((message, now));
    }

    /// Returns the message that a reader reads next.
    #[inline]
    pub(super) fn to_read(&self, reader: usize) -> Option<&Message<T>> {
        let newest = self.messages.back();
        let next = match self.order {
            ReadOrder::Newest => newest,
            ReadOrder::Oldest => self.unread(reader).next().or(newest),
        };
        next.map(|(message, _)| message)
    }

    /// Sequence number of the newest delivered message.
    pub(super) fn newest_delivered(&self) -> Option<u64> {
        self.messages.back().map(|(message, _)| message.seq)
    }

    /// Returns the messages that a reader has not seen, each with its delivery.
    pub(super) fn unread(
        &self,
        reader: usize,
    ) -> impl ExactSizeIterator<Item = &(Message<T>, Time)> {
        let next = self.readers[reader].next_unread;
        let seen = self.messages.partition_point(|(known, _)| known.seq < next);
        self.messages.range(seen..)
    }

    /// Returns the ends of the readers whose nodes its messages trigger.
    fn triggers(&self) -> impl Iterator<Item = &TriggerEnd<T>> {
        self.readers
            .iter()
            .filter_map(|reader| reader.trigger.as_deref())
    }

    /// Returns the arrivals of a message at run time `at`, for the nodes that it triggers.
    pub(super) fn arrivals(&self, at: Time) -> impl Iterator<Item = Arrival> {
        self.triggers().map(move |end| end.arrival(at))
    }

    /// Announces a message that will arrive at run time `at`.
    fn announce(&self, at: Time) {
        for end in self.triggers() {
            end.arrivals.add(end.arrival(at));
        }
    }

    /// Evicts the oldest message at run time `now`.
    pub(super) fn evict_oldest(&mut self, now: Time) {
        let Some((evicted, _)) = self.messages.pop_front() else {
            return;
        };
        for known in self.readers.iter_mut().filter(|reader| reader.is_open) {
            if known.next_unread <= evicted.seq {
                known.dropped += 1;
                let (reader, at) = (known.place, now);
                if let Some(records) = &self.records {
                    records.topic(|| TopicRecord::Dropped { reader, at });
                }
            }
        }
    }

    #[inline]
    pub(super) fn send_record<'a>(&self, record: impl FnOnce() -> TopicRecord<'a>) {
        if let Some(records) = &self.records {
            records.topic(record);
        }
    }
}

/// Read position and losses of a subscription.
pub(super) struct TopicReader<T> {
    /// Sequence number of the oldest unseen message.
    pub(super) next_unread: u64,
    /// Messages evicted before it saw them.
    pub(super) dropped: u64,
    /// Its place among the readers of the topic in a graph; `None` outside.
    pub(super) place: Option<usize>,
    /// Whether its subscription is there. A node that is built once more finds its reader again.
    pub(super) is_open: bool,
    /// Set if its messages trigger its node.
    pub(super) trigger: Option<Box<TriggerEnd<T>>>,
}

impl<T> TopicReader<T> {
    /// Creates one that has seen all messages before number `next`.
    pub(super) fn new(next: u64, place: Option<usize>) -> Self {
        Self {
            next_unread: next,
            dropped: 0,
            place,
            is_open: true,
            trigger: None,
        }
    }
}

/// A reader that triggers its node.
pub(super) struct TriggerEnd<T> {
    /// Index of the node, and number of the topic in the list of topics that trigger it.
    pub(super) node: usize,
    pub(super) input: usize,
    pub(super) arrivals: Arc<Arrivals>,
    /// The messages that it has taken and that may still be read.
    pub(super) taken: VecDeque<Message<T>>,
    /// The message that it reads.
    pub(super) chosen: Option<Message<T>>,
    /// Whether the node has yet to read it, for a node that takes each message once.
    pub(super) is_new: bool,
}

impl<T> TriggerEnd<T> {
    /// Returns the arrival of a message at run time `at`.
    pub(super) fn arrival(&self, at: Time) -> Arrival {
        let (node, input) = (self.node, self.input);
        Arrival { at, node, input }
    }
}

//! Messages on a topic.

use crate::{
    record::{Head, MessageId},
    time::Time,
};

/// A type that a topic can carry: plain data that can be copied to any thread.
pub trait Payload: Clone + Send + 'static {}

impl<T: Clone + Send + 'static> Payload for T {}

/// A published value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Message<T> {
    /// The value.
    pub data: T,
    /// Run time of publication, as the clock of its node shows it: that of the tick, or of its
    /// end if it takes run time.
    pub stamp: Time,
    /// Position in the topic's history, counted from zero.
    pub seq: u64,
    /// Run time of the sensing that the value was derived from, if known, as the clock of the node
    /// that sensed shows it: the header stamp of ROS. The last node of a chain uses it to measure
    /// the delay of the whole chain.
    pub origin: Option<Time>,
    /// The node whose data it has.
    pub(super) source: SourceRank,
    /// Index of its topic; the highest number outside of a graph.
    pub(super) topic: u32,
}

impl<T> Message<T> {
    /// Creates the message with this `head`.
    pub fn from_head(head: &Head, data: T) -> Self {
        Self {
            data,
            stamp: head.stamp,
            seq: head.seq,
            origin: head.origin,
            source: SourceRank::UNKNOWN,
            topic: u32::MAX,
        }
    }

    /// Returns the run time of the sensing behind the value; the message's own stamp if it has no
    /// origin.
    #[inline]
    pub fn sensed(&self) -> Time {
        self.origin.unwrap_or(self.stamp)
    }

    /// Returns what a message derived from this one inherits from it.
    #[inline]
    pub fn cause(&self) -> Cause {
        let (topic, seq) = (self.topic, self.seq);
        let is_known = topic != u32::MAX;
        Cause {
            message: is_known.then_some(MessageId {
                topic: topic as usize,
                seq,
            }),
            sensed: self.sensed(),
            source: self.source,
        }
    }
}

/// What a message is derived from, for a node that keeps it longer than the message itself; see
/// [`Tick::publish_from`](crate::Tick::publish_from).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cause {
    /// The message; `None` outside of a graph.
    pub(crate) message: Option<MessageId>,
    /// Run time of the sensing behind it.
    pub(crate) sensed: Time,
    pub(crate) source: SourceRank,
}

impl Cause {
    /// Returns the same with another run time of the sensing, such as a mean of two.
    #[must_use]
    pub fn sensed_at(self, sensed: Time) -> Self {
        Self { sensed, ..self }
    }

    /// Returns whether these data take precedence: the lower source rank first, then the newer
    /// sensing.
    #[inline]
    pub(crate) fn is_before(&self, other: &Self) -> bool {
        let is_newer = self.source == other.source && self.sensed > other.sensed;
        self.source < other.source || is_newer
    }
}

impl<T> From<&Message<T>> for Cause {
    fn from(message: &Message<T>) -> Self {
        message.cause()
    }
}

/// The rank of a node that begins data: nodes that read nothing come first, each in the order of the
/// graph, then nodes that had read nothing yet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct SourceRank(u32);

impl SourceRank {
    /// The rank of what comes from outside of the graph.
    pub(crate) const UNKNOWN: Self = Self(u32::MAX);

    /// The bit that puts nodes that read behind nodes that do not.
    const READER: u32 = 1 << 31;

    /// Creates the rank of the node with this index, which `reads` topics or does not.
    pub(crate) fn new(node: usize, reads: bool) -> Self {
        let node = node as u32 & (Self::READER - 1);
        Self(if reads { node | Self::READER } else { node })
    }

    /// Returns whether it is that of a node that reads topics.
    pub(crate) fn is_reader(self) -> bool {
        self != Self::UNKNOWN && self.0 & Self::READER != 0
    }
}

//! The messages of one topic as they stand in a recording.

use ratelab::runtime::{Fields, Message, Time};

/// The messages of a topic, as numbers.
#[derive(Clone, Debug, Default)]
pub struct TopicRecord {
    /// When and in which order.
    pub heads: Vec<Head>,
    /// Numbers in a message.
    pub width: usize,
    /// Those of all messages, one after the other.
    pub values: Vec<f64>,
}

/// A message without its content.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Head {
    /// Run time at which it was published.
    pub stamp: Time,
    /// Position in the topic's history.
    pub seq: u64,
    /// Run time of the sensing it was derived from.
    pub origin: Option<Time>,
    /// Messages of the topic lost unread by then.
    pub dropped: u64,
}

impl TopicRecord {
    /// The numbers in message `index`.
    pub fn row(&self, index: usize) -> &[f64] {
        let start = index * self.width;
        self.values
            .get(start..start + self.width)
            .unwrap_or_default()
    }

    /// Message `index` as it was published.
    pub fn message<T: Fields>(&self, index: usize) -> Option<Message<T>> {
        let head = self.heads.get(index)?;
        Some(Message {
            data: T::from_row(self.row(index))?,
            stamp: head.stamp,
            seq: head.seq,
            origin: head.origin,
        })
    }

    /// Forgets what is later than `until`.
    pub(super) fn cut(&mut self, until: Time) {
        let kept = self.heads.partition_point(|head| head.stamp <= until);
        self.heads.truncate(kept);
        self.values.truncate(kept * self.width);
    }
}

//! Messages as rows of numbers, for recorders, tables and plots, which are independent of
//! the payload type.

use ratelab::{Head, Message, Time};

use crate::fields::Fields;

/// Messages of one topic, each a row with the same number of values.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rows {
    heads: Vec<Head>,
    width: usize,
    values: Vec<f64>,
}

impl Rows {
    /// Creates an empty list; each message will have `width` numbers.
    pub fn new(width: usize) -> Self {
        Self {
            width,
            ..Self::default()
        }
    }

    /// Adds a message. Returns `false` and ignores the message if its number of values is
    /// wrong.
    #[must_use]
    pub fn push(&mut self, head: Head, row: impl IntoIterator<Item = f64>) -> bool {
        let before = self.values.len();
        self.values.extend(row);
        let fits = self.values.len() == before + self.width;
        if fits {
            self.heads.push(head);
        } else {
            self.values.truncate(before);
        }
        fits
    }

    /// Returns the number of messages.
    pub fn len(&self) -> usize {
        self.heads.len()
    }

    /// Returns whether there are no messages.
    pub fn is_empty(&self) -> bool {
        self.heads.is_empty()
    }

    /// Numbers per message.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Returns the messages without their payloads, oldest first.
    pub fn heads(&self) -> &[Head] {
        &self.heads
    }

    /// Returns the numbers of all messages, one after the other.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Returns the numbers of message `index`; empty without such a message.
    pub fn row(&self, index: usize) -> &[f64] {
        let start = index * self.width;
        let row = self.values.get(start..start + self.width);
        row.unwrap_or_default()
    }

    /// Returns all messages, oldest first.
    pub fn iter(&self) -> impl DoubleEndedIterator<Item = (&Head, &[f64])> {
        self.heads
            .iter()
            .enumerate()
            .map(|(index, head)| (head, self.row(index)))
    }

    /// Returns the newest message.
    pub fn last(&self) -> Option<(&Head, &[f64])> {
        self.iter().next_back()
    }

    /// Message `index` as it was published; `None` if it does not exist or its payload is
    /// invalid.
    pub fn message<T: Fields>(&self, index: usize) -> Option<Message<T>> {
        let head = self.heads.get(index)?;
        Some(Message::from_head(head, T::from_row(self.row(index))?))
    }

    /// Takes the messages up to the last one that was published by run time `until` out of
    /// these. Those of several publishers may be out of the order of time.
    pub fn take_until(&mut self, until: Time) -> Self {
        let last = self.heads.iter().rposition(|head| head.at <= until);
        let count = last.map_or(0, |last| last + 1);
        let later = Self {
            heads: self.heads.split_off(count),
            width: self.width,
            values: self.values.split_off(count * self.width),
        };
        std::mem::replace(self, later)
    }

    /// Drops the messages that were published after `until`.
    pub fn cut(&mut self, until: Time) {
        *self = self.take_until(until);
    }

    /// Drops all messages and keeps the memory.
    pub fn clear(&mut self) {
        self.heads.clear();
        self.values.clear();
    }
}

//! Messages as rows of numbers, for those who keep them without knowing what
//! they are: recorders, tables, plots.

use std::any::Any;

use super::{
    fields::Fields,
    message::{Message, Payload},
    tap::{Tap, TapMessage},
    tap_handle::TapHandle,
    time::Time,
    topic::Topic,
};

/// A message without its payload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Head {
    /// Run time at which it was published.
    pub stamp: Time,
    /// Position in the topic's history, counted from zero.
    pub seq: u64,
    /// Run time of the sensing that it was derived from, where known.
    pub origin: Option<Time>,
    /// Messages of the topic lost unread by then, over all subscriptions.
    pub dropped: u64,
    /// Run time at which it was published, whatever the clock of its node shows.
    pub released: Time,
    /// Run time at which it can be read; `None` if it is lost.
    pub arrives: Option<Time>,
}

impl Head {
    /// That of a message as a tap sees it.
    pub fn of<T>(tapped: &TapMessage<T>) -> Self {
        let message = &tapped.message;
        Self {
            stamp: message.stamp,
            seq: message.seq,
            origin: message.origin,
            dropped: tapped.dropped,
            released: tapped.released,
            arrives: tapped.arrives,
        }
    }
}

/// Messages of one topic, each a row of as many numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rows {
    heads: Vec<Head>,
    width: usize,
    values: Vec<f64>,
}

impl Rows {
    /// No messages yet; each is going to have `width` numbers.
    pub fn new(width: usize) -> Self {
        Self {
            width,
            ..Self::default()
        }
    }

    /// Adds a message. One with another number of numbers is none of this topic,
    /// and refused.
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

    fn push_message<T: Fields>(&mut self, tapped: &TapMessage<T>) {
        self.heads.push(Head::of(tapped));
        tapped.message.data.append_to(&mut self.values);
        self.values.resize(self.heads.len() * self.width, f64::NAN);
    }

    /// How many messages there are.
    pub fn len(&self) -> usize {
        self.heads.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.heads.is_empty()
    }

    /// Numbers in a message.
    pub fn width(&self) -> usize {
        self.width
    }

    /// When and in which order the messages were published.
    pub fn heads(&self) -> &[Head] {
        &self.heads
    }

    /// The numbers of all messages, one after the other.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The numbers of message `index`; none where there is no such message.
    pub fn row(&self, index: usize) -> &[f64] {
        let start = index * self.width;
        let row = self.values.get(start..start + self.width);
        row.unwrap_or_default()
    }

    /// All messages, oldest first.
    pub fn iter(&self) -> impl DoubleEndedIterator<Item = (&Head, &[f64])> {
        let rows = self.heads.iter().enumerate();
        rows.map(|(index, head)| (head, self.row(index)))
    }

    /// The newest message.
    pub fn last(&self) -> Option<(&Head, &[f64])> {
        self.iter().next_back()
    }

    /// Message `index` as it was published; `None` if there is none, or it is no
    /// such payload.
    pub fn message<T: Fields>(&self, index: usize) -> Option<Message<T>> {
        let head = self.heads.get(index)?;
        Some(Message {
            data: T::from_row(self.row(index))?,
            stamp: head.stamp,
            seq: head.seq,
            origin: head.origin,
        })
    }

    /// Takes the messages up to run time `until` out of these.
    pub fn take_until(&mut self, until: Time) -> Self {
        let count = self.heads.partition_point(|head| head.stamp <= until);
        let later = Self {
            heads: self.heads.split_off(count),
            width: self.width,
            values: self.values.split_off(count * self.width),
        };
        std::mem::replace(self, later)
    }

    /// Drops the messages later than `until`.
    pub fn cut(&mut self, until: Time) {
        *self = self.take_until(until);
    }

    /// Drops all messages and keeps the room.
    pub fn clear(&mut self) {
        self.heads.clear();
        self.values.clear();
    }
}

/// A topic whose messages can be kept as rows, whatever they are.
pub trait RecordedTopic: Any + Send + Sync {
    /// Its name.
    fn name(&self) -> &str;

    /// What the numbers of a message are; see [`Fields::FIELDS`].
    fn fields(&self) -> &'static [&'static str];

    /// Copies every message from now on, in a queue of `capacity`.
    fn tap(&self, tap_handle: &TapHandle, capacity: usize) -> RowTap;

    /// The newest message, without being counted as a reader; `None` before the
    /// first.
    fn newest(&self) -> Option<Rows>;
}

impl<T: Fields + Payload> RecordedTopic for Topic<T> {
    fn name(&self) -> &str {
        self.name()
    }

    fn fields(&self) -> &'static [&'static str] {
        T::FIELDS
    }

    fn tap(&self, tap_handle: &TapHandle, capacity: usize) -> RowTap {
        RowTap {
            width: T::FIELDS.len(),
            tap: Box::new(tap_handle.topic(self, capacity)),
        }
    }

    fn newest(&self) -> Option<Rows> {
        let newest = self.peek()?;
        let mut rows = Rows::new(T::FIELDS.len());
        rows.push_message(&newest);
        Some(rows)
    }
}

/// A [`Tap`] that hands out rows. Rows are made by whoever takes them, so the
/// publisher pays no more than for any tap.
pub struct RowTap {
    width: usize,
    tap: Box<dyn TakeRows>,
}

impl RowTap {
    /// No messages of this topic, for [`take`](Self::take) to add to.
    pub fn rows(&self) -> Rows {
        Rows::new(self.width)
    }

    /// Adds what is there to `rows`; how many messages that was.
    pub fn take(&self, rows: &mut Rows) -> usize {
        self.tap.take(rows)
    }

    /// Waits for a message and adds it, and what else is there, to `rows`; false
    /// when no more can come.
    pub fn wait(&self, rows: &mut Rows) -> bool {
        self.tap.wait(rows)
    }

    /// How many messages came while the tap was full.
    pub fn lost(&self) -> u64 {
        self.tap.lost()
    }
}

trait TakeRows: Send {
    fn take(&self, rows: &mut Rows) -> usize;
    fn wait(&self, rows: &mut Rows) -> bool;
    fn lost(&self) -> u64;
}

impl<T: Fields + Payload> TakeRows for Tap<TapMessage<T>> {
    fn take(&self, rows: &mut Rows) -> usize {
        // No more than there is now: a run without pacing fills it as fast.
        let there = self.items().len();
        for tapped in self.items().try_iter().take(there) {
            rows.push_message(&tapped);
        }
        there
    }

    fn wait(&self, rows: &mut Rows) -> bool {
        let Ok(first) = self.items().recv() else {
            return false;
        };
        rows.push_message(&first);
        self.take(rows);
        true
    }

    fn lost(&self) -> u64 {
        Self::lost(self)
    }
}

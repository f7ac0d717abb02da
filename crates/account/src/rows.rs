//! Messages as rows of numbers, for recorders, tables and plots, which are independent of
//! the payload type.

use std::any::Any;

use ratelab::{Head, Message, Payload, Subscription, Time, Topic, Wiring};

use super::{
    fields::Fields,
    telemetry::{Tap, TapHandle, TapMessage},
};

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

    fn push_message<T: Fields>(&mut self, head: Head, data: &T) {
        self.heads.push(head);
        data.append_to(&mut self.values);
        self.values.resize(self.heads.len() * self.width, f64::NAN);
    }

    /// Number of messages.
    pub fn len(&self) -> usize {
        self.heads.len()
    }

    /// Whether there are no messages.
    pub fn is_empty(&self) -> bool {
        self.heads.is_empty()
    }

    /// Numbers per message.
    pub fn width(&self) -> usize {
        self.width
    }

    /// The messages without their payloads, oldest first.
    pub fn heads(&self) -> &[Head] {
        &self.heads
    }

    /// The numbers of all messages, one after the other.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The numbers of message `index`; empty if there is no such message.
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

    /// Message `index` as it was published; `None` if it does not exist or its payload is
    /// invalid.
    pub fn message<T: Fields>(&self, index: usize) -> Option<Message<T>> {
        let head = self.heads.get(index)?;
        Some(Message {
            data: T::from_row(self.row(index))?,
            stamp: head.stamp,
            seq: head.seq,
            origin: head.origin,
        })
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

/// A topic whose messages can be kept as rows, whatever their type.
pub trait RecordedTopic: Any + Send + Sync {
    /// Name of the topic.
    fn name(&self) -> &str;

    /// Names of the numbers in a message; see [`Fields::FIELDS`].
    fn fields(&self) -> &'static [&'static str];

    /// Copies every message from now on, in a queue of `capacity`.
    fn tap(&self, tap_handle: &TapHandle, capacity: usize) -> RowTap;

    /// The newest message, read without a subscription; `None` before the first.
    fn newest(&self) -> Option<Rows>;

    /// A publisher of rows from another process.
    fn inlet(&self) -> RowInlet;

    /// Has `watcher` look at every message from now on, with the run time at which it
    /// is published. It is called by the publisher, so it has to be quick.
    fn watch(&self, tap_handle: &TapHandle, watcher: RowWatcher);

    /// A reading end for the node of `wiring`.
    fn reader(&self, wiring: &mut Wiring<'_>) -> RowReader;

    /// The same for a node that the messages trigger; see [`Wiring::trigger`].
    fn trigger(&self, wiring: &mut Wiring<'_>) -> RowReader;
}

/// Reads a message at a run time, as a [`Subscription`] does: replaces
/// the row by its numbers and returns the run time of the sensing behind it, or `None` before
/// the first.
pub type RowReader = Box<dyn FnMut(Time, &mut Vec<f64>) -> Option<Time> + Send>;

/// Publishes a row: the numbers of a message that arrived at run time `now`, was published
/// at `stamp`, and is derived from a sensing at `origin`. Returns `false` for numbers that
/// are no message of the topic. Takes: row, `now`, `stamp`, `origin`.
pub type RowInlet = Box<dyn Fn(&[f64], Time, Time, Option<Time>) -> bool + Send + Sync>;

/// Looks at the run time and the numbers of a message.
pub type RowWatcher = Box<dyn FnMut(Time, &[f64]) + Send>;

impl<T: Fields + Payload> RecordedTopic for Topic<T> {
    fn name(&self) -> &str {
        self.name()
    }

    fn fields(&self) -> &'static [&'static str] {
        T::FIELDS
    }

    fn tap(&self, tap_handle: &TapHandle, capacity: usize) -> RowTap {
        row_tap(self, T::FIELDS, tap_handle, capacity)
    }

    fn newest(&self) -> Option<Rows> {
        newest_row(self, T::FIELDS)
    }

    fn inlet(&self) -> RowInlet {
        let publisher = self.publisher();
        Box::new(move |row, now, stamp, origin| {
            let data = T::from_row(row);
            let fits = data.is_some();
            if let Some(data) = data {
                publisher.forward(data, now, stamp, origin);
            }
            fits
        })
    }

    fn watch(&self, tap_handle: &TapHandle, mut watcher: RowWatcher) {
        let mut row = Vec::with_capacity(T::FIELDS.len());
        tap_handle.watch(self, move |now, data: &T| {
            row.clear();
            data.append_to(&mut row);
            watcher(now, &row);
        });
    }

    fn reader(&self, wiring: &mut Wiring<'_>) -> RowReader {
        row_reader(wiring.subscription(self))
    }

    fn trigger(&self, wiring: &mut Wiring<'_>) -> RowReader {
        row_reader(wiring.trigger(self))
    }
}

fn row_reader<T: Fields + Payload>(mut subscription: Subscription<T>) -> RowReader {
    Box::new(move |now, row| {
        let message = subscription.latest(now)?;
        row.clear();
        message.data.append_to(row);
        Some(message.sensed())
    })
}

/// A topic whose messages have as many numbers as it has names for: their type alone does
/// not tell.
pub struct NamedTopic<T> {
    /// The topic.
    pub topic: Topic<T>,
    /// Names of the numbers in its messages.
    pub fields: &'static [&'static str],
}

impl<T: Fields + Payload> RecordedTopic for NamedTopic<T> {
    fn name(&self) -> &str {
        self.topic.name()
    }

    fn fields(&self) -> &'static [&'static str] {
        self.fields
    }

    fn tap(&self, tap_handle: &TapHandle, capacity: usize) -> RowTap {
        row_tap(&self.topic, self.fields, tap_handle, capacity)
    }

    fn newest(&self) -> Option<Rows> {
        newest_row(&self.topic, self.fields)
    }

    fn inlet(&self) -> RowInlet {
        self.topic.inlet()
    }

    fn watch(&self, tap_handle: &TapHandle, watcher: RowWatcher) {
        self.topic.watch(tap_handle, watcher);
    }

    fn reader(&self, wiring: &mut Wiring<'_>) -> RowReader {
        self.topic.reader(wiring)
    }

    fn trigger(&self, wiring: &mut Wiring<'_>) -> RowReader {
        RecordedTopic::trigger(&self.topic, wiring)
    }
}

fn row_tap<T: Fields + Payload>(
    topic: &Topic<T>,
    fields: &[&str],
    tap_handle: &TapHandle,
    capacity: usize,
) -> RowTap {
    RowTap {
        width: fields.len(),
        tap: Box::new(tap_handle.topic(topic, capacity)),
    }
}

fn newest_row<T: Fields + Payload>(topic: &Topic<T>, fields: &[&str]) -> Option<Rows> {
    let (newest, head) = topic.peek()?;
    let mut rows = Rows::new(fields.len());
    rows.push_message(head, &newest);
    Some(rows)
}

/// A [`Tap`] that returns rows. The reader builds the rows, so the publisher pays no more
/// than for any tap.
pub struct RowTap {
    width: usize,
    tap: Box<dyn TakeRows>,
}

impl RowTap {
    /// The rows of `tap`, each of `width` numbers.
    pub fn of(tap: Tap<(Head, Vec<f64>)>, width: usize) -> Self {
        Self {
            width,
            tap: Box::new(tap),
        }
    }

    /// An empty list for messages of this topic, for [`take`](Self::take) to fill.
    pub fn rows(&self) -> Rows {
        Rows::new(self.width)
    }

    /// Adds the available messages to `rows`; returns their number.
    pub fn take(&self, rows: &mut Rows) -> usize {
        self.tap.take(rows)
    }

    /// Waits for a message and adds all available ones to `rows`; `false` when the tap
    /// has ended.
    pub fn wait(&self, rows: &mut Rows) -> bool {
        self.tap.wait(rows)
    }

    /// Number of messages lost because the tap was full.
    pub fn lost(&self) -> u64 {
        self.tap.lost()
    }
}

trait TakeRows: Send {
    fn take(&self, rows: &mut Rows) -> usize;
    fn wait(&self, rows: &mut Rows) -> bool;
    fn lost(&self) -> u64;
}

/// An item of a tap that is a row.
trait RowItem: Send {
    fn push_to(&self, rows: &mut Rows);
}

impl<T: Fields + Payload> RowItem for TapMessage<T> {
    fn push_to(&self, rows: &mut Rows) {
        rows.push_message(self.head(), &self.message.data);
    }
}

impl RowItem for (Head, Vec<f64>) {
    fn push_to(&self, rows: &mut Rows) {
        // A row of another width is no message of the topic.
        let _ = rows.push(self.0, self.1.iter().copied());
    }
}

impl<I: RowItem> TakeRows for Tap<I> {
    fn take(&self, rows: &mut Rows) -> usize {
        // Only those available now: a run without pacing could fill the tap as fast as
        // this loop empties it.
        let there = self.items().len();
        for tapped in self.items().try_iter().take(there) {
            tapped.push_to(rows);
        }
        there
    }

    fn wait(&self, rows: &mut Rows) -> bool {
        let Ok(first) = self.items().recv() else {
            return false;
        };
        first.push_to(rows);
        self.take(rows);
        true
    }

    fn lost(&self) -> u64 {
        Self::lost(self)
    }
}

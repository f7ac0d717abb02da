//! Topics whose messages are recorded as rows of numbers.

use std::any::Any;

use ratelab::{Head, Payload, Subscription, Tick, Time, Topic, Wiring};

use crate::{fields::Fields, rows::Rows, tap::Tap, tap_handle::TapHandle};

/// A topic whose messages can be kept as rows, whatever their type.
pub trait RecordedTopic: Any + Send + Sync {
    /// Returns the name of the topic.
    fn name(&self) -> &str;

    /// Returns the names of the numbers in a message; see [`Fields::FIELDS`].
    fn fields(&self) -> &[String];

    /// Passes every message to `listener` from now on. It is called by the publisher, so it has
    /// to be quick.
    fn listen(&self, tap_handle: &TapHandle, listener: RowListener);

    /// Copies every message from now on, in a queue of `capacity`.
    fn tap(&self, tap_handle: &TapHandle, capacity: usize) -> RowTap {
        let (end, tap) = tap_handle.tap(capacity);
        let copy = move |head: &Head, row: &[f64]| end.offer((*head, row.to_vec()));
        self.listen(tap_handle, Box::new(copy));
        let width = self.fields().len();
        RowTap { width, tap }
    }

    /// Returns the newest message, read without a subscription; `None` before the first.
    fn newest(&self) -> Option<Rows>;

    /// Returns a publisher of rows from another process.
    fn inlet(&self) -> RowInlet;

    /// Returns a reading end for the node of `wiring`.
    fn reader(&self, wiring: &mut Wiring<'_>) -> RowReader;

    /// Returns a reading end for a node that the messages trigger; see [`Wiring::trigger`].
    fn trigger(&self, wiring: &mut Wiring<'_>) -> RowReader;
}

/// Reads a message in a tick, as [`Tick::read`] does: replaces the row by its numbers and returns the
/// run time of the sensing behind it, or `None` before the first.
pub type RowReader = Box<dyn FnMut(&mut Tick, &mut Vec<f64>) -> Option<Time> + Send>;

/// Publishes a row: the numbers of a message that arrived at run time `now`, was published
/// at `stamp`, and is derived from a sensing at `origin`. Returns the sequence number;
/// `None` if the numbers form no message of the topic. Takes: row, `now`, `stamp`, `origin`.
pub type RowInlet = Box<dyn Fn(&[f64], Time, Time, Option<Time>) -> Option<u64> + Send + Sync>;

/// Takes the numbers of a message; returns `false` once it wants no more.
pub type RowListener = Box<dyn FnMut(&Head, &[f64]) -> bool + Send>;

/// A topic with the names of the numbers in its messages: their type alone may not tell how
/// many there are.
pub struct NamedTopic<T> {
    /// The topic.
    pub topic: Topic<T>,
    /// The names.
    pub fields: Vec<String>,
}

impl<T: Fields + Payload> RecordedTopic for NamedTopic<T> {
    fn name(&self) -> &str {
        self.topic.name()
    }

    fn fields(&self) -> &[String] {
        &self.fields
    }

    fn listen(&self, tap_handle: &TapHandle, mut listener: RowListener) {
        let (mut row, width) = (Vec::new(), self.fields.len());
        tap_handle.listen(&self.topic, move |head, data: &T| {
            fill(&mut row, data, width);
            listener(head, &row)
        });
    }

    fn newest(&self) -> Option<Rows> {
        let ((newest, head), width) = (self.topic.peek()?, self.fields.len());
        let (mut row, mut rows) = (Vec::new(), Rows::new(width));
        fill(&mut row, &newest, width);
        rows.push(head, row).then_some(rows)
    }

    fn inlet(&self) -> RowInlet {
        let publisher = self.topic.publisher();
        Box::new(move |row, now, stamp, origin| {
            let data = T::from_row(row)?;
            Some(publisher.forward(data, now, stamp, origin))
        })
    }

    fn reader(&self, wiring: &mut Wiring<'_>) -> RowReader {
        row_reader(wiring.subscription(&self.topic))
    }

    fn trigger(&self, wiring: &mut Wiring<'_>) -> RowReader {
        row_reader(wiring.trigger(&self.topic))
    }
}

/// Replaces `row` by the numbers of a message: as many as the topic has names for.
fn fill<T: Fields>(row: &mut Vec<f64>, data: &T, width: usize) {
    row.clear();
    data.append_to(row);
    row.resize(width, f64::NAN);
}

fn row_reader<T: Fields + Payload>(mut subscription: Subscription<T>) -> RowReader {
    Box::new(move |tick, row| {
        let message = tick.read(&mut subscription)?;
        row.clear();
        message.data.append_to(row);
        Some(message.sensed())
    })
}

/// A [`Tap`] whose items are rows, each of the same width.
pub struct RowTap {
    width: usize,
    tap: Tap<(Head, Vec<f64>)>,
}

impl RowTap {
    /// Returns an empty list for messages of this topic, for [`take`](Self::take) to fill.
    pub fn rows(&self) -> Rows {
        Rows::new(self.width)
    }

    /// Adds the available messages to `rows`; returns their number.
    pub fn take(&self, rows: &mut Rows) -> usize {
        // Only those available now: a run without pacing could fill the tap as fast as
        // this loop empties it.
        let there = self.tap.items().len();
        for (head, row) in self.tap.items().try_iter().take(there) {
            let _ = rows.push(head, row);
        }
        there
    }

    /// Waits for a message and adds all available ones to `rows`; `false` when the tap
    /// has ended.
    pub fn wait(&self, rows: &mut Rows) -> bool {
        let Ok((head, row)) = self.tap.items().recv() else {
            return false;
        };
        let _ = rows.push(head, row);
        self.take(rows);
        true
    }

    /// Returns the number of messages lost because the tap was full.
    pub fn lost(&self) -> u64 {
        self.tap.lost()
    }
}

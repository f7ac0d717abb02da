//! Taps on a running graph: on a topic, on topics whose messages are rows of numbers, on all rows
//! of a run.

use std::{any::Any, fmt};

use ratelab::{
    ForwardedTimes, Graph, Head, Message, Payload, Sink, Subscription, Tick, Time, Topic, Wiring,
    sync::Arc,
};

use crate::{
    accounts::AccountSink,
    fields::{Fields, Rows},
    node::TickRecord,
    tap::{LotSender, Tap, TapMessage, TapSender, tap},
};

/// Taps a graph from any thread, before and during its run. Covers the nodes and topics that the
/// graph had when it was first tapped or observed.
///
/// The clock decides whether a full tap blocks: in virtual time it does, because waiting
/// costs no run time; in real time it loses messages and counts them.
#[derive(Clone)]
pub struct TapHandle(pub(crate) Arc<AccountSink>);

impl TapHandle {
    /// Taps on `graph`.
    pub fn new(graph: &Graph) -> Self {
        Self(AccountSink::from_graph(graph))
    }

    /// Sends every record to one other `sink` from now on, before it is counted here; returns
    /// `false` if there is another sink already.
    pub fn forward_records_to(&self, sink: Arc<dyn Sink>) -> bool {
        self.0.first.set(sink).is_ok()
    }

    /// Copies every message of `topic` from now on, in a queue of `capacity` messages.
    pub fn topic<T: Payload>(&self, topic: &Topic<T>, capacity: usize) -> Tap<TapMessage<T>> {
        let (end, tap) = self.tap(capacity);
        self.listen(topic, move |head, data: &T| {
            let (message, head) = (Message::from_head(head, data.clone()), *head);
            end.offer(TapMessage { message, head })
        });
        tap
    }

    /// Copies every tick from now on, with one queue of `capacity` ticks per node, in the
    /// order of addition. The taps end with the graph.
    pub fn ticks(&self, capacity: usize) -> Vec<Tap<TickRecord>> {
        let taps = self.0.ticks.iter().map(|node| {
            let (end, tap) = self.tap(capacity);
            node.add(Box::new(move |tick: &TickRecord| end.offer(tick.clone())));
            tap
        });
        taps.collect()
    }

    /// Returns a tap for `capacity` items, with the end to be filled by a listener.
    pub(crate) fn tap<I>(&self, capacity: usize) -> (TapSender<I>, Tap<I>) {
        tap(capacity, Some(self.0.run.clone()))
    }

    /// Calls `hear` with every message of `topic` from now on, when it is published, until that
    /// returns `false`. It is called by the publisher, so it has to be quick.
    pub(crate) fn listen<T: Payload>(
        &self,
        topic: &Topic<T>,
        mut hear: impl FnMut(&Head, &T) -> bool + Send + 'static,
    ) {
        let index = topic.index();
        if let Some(listeners) = index.and_then(|index| self.0.topics.get(index)) {
            listeners.add(Box::new(move |head: &Head, payload: &dyn Any| {
                payload.downcast_ref().is_some_and(|data| hear(head, data))
            }));
        }
    }
}

impl fmt::Debug for TapHandle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("TapHandle").finish_non_exhaustive()
    }
}

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

/// Publishes a row: the numbers of a message that arrives from another process. Returns the sequence
/// number; `None` if the numbers form no message of the topic.
pub type RowInlet = Box<dyn Fn(&[f64], ForwardedTimes) -> Option<u64> + Send + Sync>;

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
        Box::new(move |row, times| Some(publisher.forward(T::from_row(row)?, times)))
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

/// A row of a run, of the topic or the node with an index.
#[derive(Clone, Debug, PartialEq)]
pub enum RunRow {
    /// A message with its numbers.
    Message(usize, Head, Vec<f64>),
    /// A tick.
    Tick(usize, TickRecord),
}

impl TapHandle {
    /// Copies every message of `topics` and every tick from now on, in one queue of `capacity`:
    /// a tick comes after its messages.
    pub fn all(&self, topics: &[&dyn RecordedTopic], capacity: usize) -> Tap<RunRow> {
        let (all, tap) = self.tap(capacity);
        self.each_tick({
            let end = all.clone();
            move |node, tick| end.offer(RunRow::Tick(node, tick.clone()))
        });
        for topic in topics {
            if let Some(index) = self.0.accounts.topology.topic(topic.name()) {
                let end = all.clone();
                let copy = move |head: &Head, row: &[f64]| {
                    end.offer(RunRow::Message(index, *head, row.to_vec()))
                };
                topic.listen(self, Box::new(copy));
            }
        }
        tap
    }

    /// Copies every message of all topics, without its numbers, and every tick from now on, in one
    /// queue of `capacity` lots: many rows in a lot, a tick after its messages.
    pub fn heads(&self, capacity: usize) -> Tap<Vec<RunRow>> {
        let (end, tap) = self.tap(capacity);
        let all = Arc::new(LotSender::new(end));
        for (index, listeners) in self.0.topics.iter().enumerate() {
            let all = all.clone();
            listeners.add(Box::new(move |head, _| {
                all.offer(RunRow::Message(index, *head, Vec::new()))
            }));
        }
        self.each_tick(move |node, tick| all.offer(RunRow::Tick(node, tick.clone())));
        tap
    }

    /// Calls `hear` with every tick from now on, until that returns `false`.
    fn each_tick(&self, hear: impl Fn(usize, &TickRecord) -> bool + Clone + Send + 'static) {
        for (node, ticks) in self.0.ticks.iter().enumerate() {
            let hear = hear.clone();
            ticks.add(Box::new(move |tick| hear(node, tick)));
        }
    }
}

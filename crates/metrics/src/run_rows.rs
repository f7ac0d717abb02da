//! All rows of a run in one tap.

use ratelab::Head;

use super::{
    node::TickRecord,
    recorded::RecordedTopic,
    tap::{Tap, TapSender},
    tap_handle::TapHandle,
};

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
        self.send_rows(topics, &all);
        tap
    }

    /// Copies every message of all topics, without its numbers, and every tick from now on, in one
    /// queue of `capacity`.
    pub fn heads(&self, capacity: usize) -> Tap<RunRow> {
        let (all, tap) = self.tap(capacity);
        self.send_rows(&[], &all);
        for (index, listeners) in self.0.topics.iter().enumerate() {
            let end = all.clone();
            listeners.add(Box::new(move |head, _| {
                end.offer(RunRow::Message(index, *head, Vec::new()))
            }));
        }
        tap
    }

    fn send_rows(&self, topics: &[&dyn RecordedTopic], all: &TapSender<RunRow>) {
        for (node, ticks) in self.0.ticks.iter().enumerate() {
            let end = all.clone();
            ticks.add(Box::new(move |tick| {
                end.offer(RunRow::Tick(node, tick.clone()))
            }));
        }
        for topic in topics {
            if let Some(index) = self.0.accounts.topology.topic(topic.name()) {
                let end = all.clone();
                let copy = move |head: &Head, row: &[f64]| {
                    end.offer(RunRow::Message(index, *head, row.to_vec()))
                };
                topic.listen(self, Box::new(copy));
            }
        }
    }
}

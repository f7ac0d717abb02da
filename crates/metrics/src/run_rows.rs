//! All rows of a run in one tap.

use ratelab::{Head, sync::Arc};

use crate::{
    node::TickRecord,
    recorded::RecordedTopic,
    tap::{LotSender, Tap},
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

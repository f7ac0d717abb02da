//! Taps on a running experiment.

use std::{any::Any, sync::Arc};

use ratelab::Payload;
use ratelab_metrics::{
    NamedTopic, RecordedTopic, RowTap, RunRow, Tap, TapHandle, TapMessage, TickRecord,
};

use ratelab_system::{ChainTracker, TopicChains};

/// Taps the recorded topics and the nodes of an experiment, before and during its run,
/// from any thread.
///
/// Taps on topics end when the run is over and the last of these handles is dropped. A
/// thread that empties a tap must not use this handle meanwhile: a topic that waits for a
/// full tap stays locked.
#[derive(Clone)]
pub struct Taps {
    pub(super) tap_handle: TapHandle,
    pub(super) topics: Vec<Arc<dyn RecordedTopic>>,
    pub(super) tracker: Option<Arc<ChainTracker>>,
}

impl Taps {
    /// Returns the chains through the topic with this index in the graph.
    pub fn chains(&self, topic: usize) -> TopicChains {
        let tracker = self.tracker.as_ref();
        tracker
            .map(|known| known.through(topic))
            .unwrap_or_default()
    }

    /// Returns the recorded topics, in the order of their creation.
    pub fn topics(&self) -> &[Arc<dyn RecordedTopic>] {
        &self.topics
    }

    /// Returns the recorded topic called `name`.
    pub(super) fn topic(&self, name: &str) -> Option<&dyn RecordedTopic> {
        self.topics
            .iter()
            .find(|topic| topic.name() == name)
            .map(|topic| &**topic)
    }

    /// Copies every message of the recorded topic called `name` from now on, as
    /// rows, in a queue of `capacity`; `None` without such a topic.
    pub fn rows(&self, name: &str, capacity: usize) -> Option<RowTap> {
        Some(self.topic(name)?.tap(&self.tap_handle, capacity))
    }

    /// Returns a tap of a topic's messages; `None` also for another payload type.
    pub fn messages<T: Payload>(&self, name: &str, capacity: usize) -> Option<Tap<TapMessage<T>>> {
        let topic: &dyn Any = self.topic(name)?;
        let named = topic.downcast_ref::<NamedTopic<T>>()?;
        Some(self.tap_handle.topic(&named.topic, capacity))
    }

    /// Copies every message of the recorded topics and every tick from now on, in one queue of
    /// `capacity`: a tick comes after its messages.
    pub fn all(&self, capacity: usize) -> Tap<RunRow> {
        let topics: Vec<_> = self.topics.iter().map(|topic| &**topic).collect();
        self.tap_handle.all(&topics, capacity)
    }

    /// Copies every message of all topics, without its numbers, and every tick from now on, in one
    /// queue of `capacity` lots.
    pub fn heads(&self, capacity: usize) -> Tap<Vec<RunRow>> {
        self.tap_handle.heads(capacity)
    }

    /// Copies every tick from now on, with one queue of `capacity` ticks per node, in the
    /// order of addition.
    pub fn ticks(&self, capacity: usize) -> Vec<Tap<TickRecord>> {
        self.tap_handle.ticks(capacity)
    }
}

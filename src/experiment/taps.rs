//! Taps on a running experiment.

use super::Topics;
use crate::{
    cartpole::{Action, ControlStep, Observation},
    runtime::{Tap, TapHandle, TapMessage, TickRecord},
};

/// Taps the topics and nodes of an experiment, before it runs and while it does,
/// from any thread.
///
/// Taps on topics end when the run is over and the last of these handles is
/// gone. A thread that empties a tap must not use this while others wait for it:
/// a topic on which a full tap is being waited for lets nobody in.
#[derive(Clone)]
pub struct Taps {
    tap_handle: TapHandle,
    topics: Topics,
}

impl Taps {
    pub(super) fn new(tap_handle: TapHandle, topics: Topics) -> Self {
        Self { tap_handle, topics }
    }

    /// Copies every observation from now on, in a queue of `capacity`.
    pub fn observations(&self, capacity: usize) -> Tap<TapMessage<Observation>> {
        self.tap_handle.topic(&self.topics.observations, capacity)
    }

    /// Copies every action from now on, in a queue of `capacity`.
    pub fn actions(&self, capacity: usize) -> Tap<TapMessage<Action>> {
        self.tap_handle.topic(&self.topics.actions, capacity)
    }

    /// Copies every control step from now on, in a queue of `capacity`.
    pub fn steps(&self, capacity: usize) -> Tap<TapMessage<ControlStep>> {
        self.tap_handle.topic(&self.topics.steps, capacity)
    }

    /// Copies every tick from now on, for each node in the order in which they
    /// were added, in queues of `capacity`.
    pub fn ticks(&self, capacity: usize) -> Vec<Tap<TickRecord>> {
        self.tap_handle.ticks(capacity)
    }
}

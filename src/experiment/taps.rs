//! Taps on a running experiment.

use super::Topics;
use crate::{
    cartpole::{Action, ControlStep, Observation},
    runtime::{Tap, Tapped, Tapper, Ticked},
};

/// Taps the topics and nodes of an experiment, before it runs and while it does,
/// from any thread.
///
/// Taps on topics end when the run is over and the last of these handles is
/// gone. A thread that empties a tap must not use this while others wait for it:
/// a topic on which a full tap is being waited for lets nobody in.
#[derive(Clone)]
pub struct Taps {
    tapper: Tapper,
    topics: Topics,
}

impl Taps {
    pub(super) fn new(tapper: Tapper, topics: Topics) -> Self {
        Self { tapper, topics }
    }

    /// Copies every observation from now on, in a queue of `capacity`.
    pub fn observations(&self, capacity: usize) -> Tap<Tapped<Observation>> {
        self.tapper.topic(&self.topics.observations, capacity)
    }

    /// Copies every action from now on, in a queue of `capacity`.
    pub fn actions(&self, capacity: usize) -> Tap<Tapped<Action>> {
        self.tapper.topic(&self.topics.actions, capacity)
    }

    /// Copies every control step from now on, in a queue of `capacity`.
    pub fn steps(&self, capacity: usize) -> Tap<Tapped<ControlStep>> {
        self.tapper.topic(&self.topics.steps, capacity)
    }

    /// Copies every tick from now on, for each node in the order in which they
    /// were added, in queues of `capacity`.
    pub fn ticks(&self, capacity: usize) -> Vec<Tap<Ticked>> {
        self.tapper.ticks(capacity)
    }
}

//! A brain that takes its time.

use std::time::Duration;

use super::Policy;
use crate::cartpole::{Action, Observation};

/// Lets another policy think longer, in wall time: what a heavy network does to
/// a graph under the real clock. Virtual time knows no thinking time.
pub struct Thinking {
    policy: Box<dyn Policy>,
    time: Duration,
}

impl Thinking {
    /// `policy`, answering `time` later than it would.
    pub fn new(policy: Box<dyn Policy>, time: Duration) -> Self {
        Self { policy, time }
    }
}

impl Policy for Thinking {
    fn name(&self) -> &str {
        self.policy.name()
    }

    fn act(&mut self, observation: &Observation) -> Action {
        std::thread::sleep(self.time);
        self.policy.act(observation)
    }

    fn become_brain(&mut self, word: &str) -> Result<String, String> {
        self.policy.become_brain(word)
    }
}

//! A policy that takes its time.

use std::time::Duration;

use super::Policy;
use crate::cartpole::{Action, Observation};

/// Lets another policy think longer, in wall time: what a heavy network does to
/// a graph under the real clock. Virtual time knows no thinking time.
pub struct DelayedPolicy {
    policy: Box<dyn Policy>,
    time: Duration,
}

impl DelayedPolicy {
    /// `policy`, answering `time` later than it would.
    pub fn new(policy: Box<dyn Policy>, time: Duration) -> Self {
        Self { policy, time }
    }
}

impl Policy for DelayedPolicy {
    fn name(&self) -> &str {
        self.policy.name()
    }

    fn act(&mut self, observation: &Observation) -> Action {
        std::thread::sleep(self.time);
        self.policy.act(observation)
    }

    fn swap(&mut self, name: &str) -> Result<String, String> {
        self.policy.swap(name)
    }

    fn restart(&mut self) -> Result<(), String> {
        self.policy.restart()
    }
}

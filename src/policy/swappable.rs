//! A brain that can become another one.

use super::{Brain, BrainError, Policy, Setting, Shelf};
use crate::cartpole::{Action, Observation};

/// Decides as one brain until it is told to become another. One that is on its
/// shelf waits for no file.
pub struct Swappable {
    now: Box<dyn Policy>,
    /// What `now` is, as text.
    brain: String,
    setting: Setting,
    shelf: Shelf,
}

impl Swappable {
    /// Begins as `first`.
    ///
    /// # Errors
    /// [`BrainError`] if it cannot be had.
    pub fn new(first: &Brain, mut shelf: Shelf, setting: Setting) -> Result<Self, BrainError> {
        let loaded = shelf.fetch(first)?;
        Ok(Self {
            now: loaded.policy(setting)?,
            brain: loaded.brain().to_string(),
            setting,
            shelf,
        })
    }
}

impl Policy for Swappable {
    fn name(&self) -> &str {
        self.now.name()
    }

    fn act(&mut self, observation: &Observation) -> Action {
        self.now.act(observation)
    }

    fn become_brain(&mut self, word: &str) -> Result<String, String> {
        let brain: Brain = word.parse().map_err(|error| format!("{error}"))?;
        let loaded = self
            .shelf
            .fetch(&brain)
            .map_err(|error| error.to_string())?;
        let next = loaded
            .policy(self.setting)
            .map_err(|error| error.to_string())?;
        self.now = next;
        let brain = loaded.brain().to_string();
        Ok(std::mem::replace(&mut self.brain, brain))
    }
}

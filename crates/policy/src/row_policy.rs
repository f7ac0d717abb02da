//! The interface of a policy in a file, and what it is made with.

use std::time::Duration;

use ratelab::{Hz, Time};

use crate::PolicyFault;

/// The inputs of a policy besides its observations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PolicyContext {
    /// The seed of the run.
    pub seed: u64,
    /// Control rate at the start of the run.
    pub control_hz: Hz,
    /// Number of actions in a chunk; `None` for single actions.
    pub chunk: Option<usize>,
}

/// When a policy is asked.
#[derive(Clone, Copy, Debug, Default)]
pub struct Moment {
    /// Run time of the reading.
    pub origin: Time,
    /// Start of the tick.
    pub now: Time,
    /// How long after that its chunk is expected to be played; zero without chunks.
    pub expected: Duration,
}

impl Moment {
    /// Returns the age that the reading is expected to have when its chunk begins to be played.
    pub fn delay(&self) -> Duration {
        self.now.since(self.origin) + self.expected
    }
}

/// How many numbers a policy sees, and how many it answers with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RowShape {
    /// Numbers of an observation.
    pub sees: usize,
    /// Numbers of an action; `None` for an action that is a number by itself.
    pub acts: Option<usize>,
    /// How long an action counts (ns).
    pub action_ns: u64,
}

/// What the answers of a policy are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AnswerKind {
    /// Single actions.
    Action,
    /// Chunks of actions for the state that it is shown.
    Chunk,
    /// Chunks of actions, by a policy with a model of its own.
    WholeChunk,
}

impl RowShape {
    /// Returns the numbers of an action.
    pub(crate) fn width(self) -> usize {
        self.acts.unwrap_or(1)
    }
}

impl AnswerKind {
    /// Returns what an answer of a network is, with so many numbers, to a robot with so many in an
    /// action.
    pub(crate) fn from_size(numbers: usize, width: usize) -> Self {
        if numbers <= width {
            Self::Action
        } else {
            Self::Chunk
        }
    }
}

/// Answers observations.
pub trait RowPolicy: Send {
    /// Makes itself ready for a run.
    ///
    /// # Errors
    /// The reason if it cannot.
    fn start(&mut self) -> Result<(), PolicyFault> {
        Ok(())
    }

    /// Hears of the tick in which it will be asked.
    fn begin(&mut self, moment: Moment) {
        let _ = moment;
    }

    /// Returns the answer to an observation; nothing if it has died.
    fn answer(&mut self, observation: &[f64]) -> &[f64];

    /// Returns what its answers are.
    fn kind(&self) -> AnswerKind {
        AnswerKind::Action
    }

    /// Returns why it has died in this tick, and what to do, if it has.
    fn crash(&mut self) -> Option<String> {
        None
    }
}

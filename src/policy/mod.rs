//! Brains: from an observation to an action.
//!
//! A policy sees messages and nothing else, so any of these can be put behind
//! the same node.

mod constant;
mod random;
mod scripted;
mod thinking;

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::cartpole::{Action, Observation};

pub use constant::Zero;
pub use random::Random;
pub use scripted::Scripted;
pub use thinking::Thinking;

/// Decides what to do about an observation.
pub trait Policy: Send {
    /// What it is called.
    fn name(&self) -> &str;

    /// The action for `observation`. One that is not finite ends the run with
    /// a fault.
    fn act(&mut self, observation: &Observation) -> Action;
}

/// The policies that need no file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum PolicyKind {
    /// Linear feedback: [`Scripted`].
    Scripted,
    /// No force: [`Zero`].
    Zero,
    /// Any force: [`Random`].
    Random,
}

impl PolicyKind {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Scripted, Self::Zero, Self::Random];

    /// The name by which it is chosen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scripted => "scripted",
            Self::Zero => "zero",
            Self::Random => "random",
        }
    }

    /// Whether it tries to keep the pole up. One that does not loses it at any
    /// rate, so nothing is to be learned from that about rates.
    pub fn balances(self) -> bool {
        match self {
            Self::Scripted => true,
            Self::Zero | Self::Random => false,
        }
    }

    /// The policy itself; `seed` is that of the run.
    pub fn build(self, seed: u64) -> Box<dyn Policy> {
        match self {
            Self::Scripted => Box::new(Scripted),
            Self::Zero => Box::new(Zero),
            Self::Random => Box::new(Random::new(seed)),
        }
    }
}

impl fmt::Display for PolicyKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for PolicyKind {
    type Err = UnknownPolicy;

    fn from_str(text: &str) -> Result<Self, UnknownPolicy> {
        let known = Self::ALL.into_iter().find(|kind| kind.name() == text);
        known.ok_or_else(|| UnknownPolicy(text.to_owned()))
    }
}

/// A name that belongs to no policy.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{0:?} is not a policy: expected scripted, zero or random")]
pub struct UnknownPolicy(String);

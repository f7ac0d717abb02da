//! The policies without a file.

use std::str::FromStr;

use serde::{Deserialize, Serialize};
use strum::{Display, IntoStaticStr};
use thiserror::Error;

/// The policies without a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Display, IntoStaticStr)]
#[strum(serialize_all = "lowercase")]
pub enum PolicyKind {
    /// Linear feedback: [`Scripted`](super::Scripted).
    Scripted,
    /// No force: [`Zero`](super::Zero).
    Zero,
    /// Any force: [`Random`](super::Random).
    Random,
    /// Linear feedback with gains from theory: [`Lqr`](super::Lqr).
    Lqr,
}

impl PolicyKind {
    /// All kinds.
    pub const ALL: [Self; 4] = [Self::Scripted, Self::Zero, Self::Random, Self::Lqr];

    /// The name in settings.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Whether it tries to keep the pole up. Other policies lose it at any rate, so their
    /// runs show nothing about rates.
    pub fn balances(self) -> bool {
        match self {
            Self::Scripted | Self::Lqr => true,
            Self::Zero | Self::Random => false,
        }
    }
}

impl FromStr for PolicyKind {
    type Err = UnknownPolicy;

    fn from_str(text: &str) -> Result<Self, UnknownPolicy> {
        let known = Self::ALL.into_iter().find(|kind| kind.name() == text);
        known.ok_or_else(|| UnknownPolicy(text.to_owned()))
    }
}

/// An unknown policy.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error(
    "{0:?} is not a policy: expected scripted, zero, random, lqr, a file of weights or a program"
)]
pub struct UnknownPolicy(pub(super) String);

//! The quality of service of a topic: how many messages its queue keeps, and which of them a node
//! reads.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Number of messages a topic keeps: one or more.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "usize", into = "usize")]
pub struct Depth(usize);

impl Depth {
    /// A buffer of one message: only the newest survives.
    pub const ONE: Self = Self(1);

    /// The deepest queue accepted. Anything deeper is a log rather than a queue.
    pub const MAX: Self = Self(1_000_000);

    /// Validates a queue depth.
    ///
    /// # Errors
    /// [`DepthError`] if `messages` is zero or more than [`Depth::MAX`].
    pub fn new(messages: usize) -> Result<Self, DepthError> {
        if (1..=Self::MAX.0).contains(&messages) {
            Ok(Self(messages))
        } else {
            Err(DepthError(messages.to_string()))
        }
    }

    /// Returns the number of messages.
    pub fn get(self) -> usize {
        self.0
    }
}

impl TryFrom<usize> for Depth {
    type Error = DepthError;

    fn try_from(messages: usize) -> Result<Self, DepthError> {
        Self::new(messages)
    }
}

impl From<Depth> for usize {
    fn from(depth: Depth) -> Self {
        depth.get()
    }
}

impl fmt::Display for Depth {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl FromStr for Depth {
    type Err = DepthError;

    fn from_str(text: &str) -> Result<Self, DepthError> {
        let messages = text
            .trim()
            .parse()
            .map_err(|_| DepthError(text.to_owned()))?;
        Self::new(messages)
    }
}

/// An invalid queue depth, as it was given.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{0:?} is not a queue depth: expected a whole number from 1 to {max}", max = Depth::MAX)]
pub struct DepthError(String);

/// The order in which a topic's subscriptions read its messages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ReadOrder {
    /// The newest message; older ones are skipped.
    #[default]
    Newest,
    /// The oldest unread message, like a callback queue; the last one again if all are
    /// read.
    Oldest,
}

impl fmt::Display for ReadOrder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Newest => "newest",
            Self::Oldest => "oldest",
        })
    }
}

impl FromStr for ReadOrder {
    type Err = ReadOrderError;

    fn from_str(text: &str) -> Result<Self, ReadOrderError> {
        match text.trim() {
            "newest" => Ok(Self::Newest),
            "oldest" => Ok(Self::Oldest),
            _ => Err(ReadOrderError(text.to_owned())),
        }
    }
}

/// An invalid read order, as it was given.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{0:?} is not a read order: expected newest or oldest")]
pub struct ReadOrderError(String);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_and_the_greatest_depth_are_accepted_and_no_other_beyond() {
        assert_eq!(Depth::new(1), Ok(Depth::ONE));
        assert_eq!(Depth::new(1_000_000), Ok(Depth::MAX));
        assert!(Depth::new(0).is_err() && Depth::new(1_000_001).is_err());
    }
}

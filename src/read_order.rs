//! The order in which a node reads the messages of a topic.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};

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
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.trim() {
            "newest" => Ok(Self::Newest),
            "oldest" => Ok(Self::Oldest),
            _ => Err(format!("{text:?} is no order: expected newest or oldest")),
        }
    }
}

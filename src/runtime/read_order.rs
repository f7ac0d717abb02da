//! Which message of a topic a node reads.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};

/// Which message of a topic its subscriptions read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ReadOrder {
    /// The newest; those before it are passed over.
    #[default]
    Newest,
    /// The oldest that was not read yet, as a queue of callbacks does; the last one
    /// again where there is none.
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

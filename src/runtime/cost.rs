//! What a tick takes.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};

use super::draw::Draw;

/// Before a cost that keeps a core busy.
const BUSY: &str = "busy ";

/// What the ticks of a node take, in run time: a [`Draw`], as text with `busy `
/// before it if the real clock is to keep a core busy for so long instead of
/// sleeping.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Cost {
    /// How long a tick takes.
    pub draw: Draw,
    /// Whether it keeps a core busy under the real clock.
    pub busy: bool,
}

impl Cost {
    /// Ticks take no time.
    pub const NONE: Self = Self {
        draw: Draw::NONE,
        busy: false,
    };
}

impl fmt::Display for Cost {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let busy = if self.busy { BUSY } else { "" };
        write!(f, "{busy}{}", self.draw)
    }
}

impl FromStr for Cost {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let draw = text.trim().strip_prefix(BUSY);
        Ok(Self {
            draw: draw.unwrap_or(text).parse()?,
            busy: draw.is_some(),
        })
    }
}

impl TryFrom<String> for Cost {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<Cost> for String {
    fn from(cost: Cost) -> Self {
        cost.to_string()
    }
}

//! The duration of ticks.

use std::{fmt, str::FromStr};

use super::{draw::Draw, error::SettingError};

/// Prefix of a cost that keeps a core busy.
const BUSY: &str = "busy ";

/// The duration of a node's ticks in run time: a [`Draw`], as text with the prefix `busy
/// ` if the real clock is to keep a core busy instead of sleeping.
#[derive(Clone, Debug, PartialEq)]
pub struct Cost {
    /// Duration of a tick.
    pub draw: Draw,
    /// Whether a tick keeps a core busy under the real clock.
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
    type Err = SettingError;

    fn from_str(text: &str) -> Result<Self, SettingError> {
        let draw = text.trim().strip_prefix(BUSY);
        Ok(Self {
            draw: draw.unwrap_or(text).parse()?,
            busy: draw.is_some(),
        })
    }
}

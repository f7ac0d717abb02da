//! The actuator's handling of stale actions.

use std::{fmt, str::FromStr, time::Duration};

use ratelab::{Draw, millis::to_millis};

use crate::ParameterError;

/// The actuator's handling of an action with old sensing. As text `hold`, or `zero:50`
/// (ms).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OnStale {
    /// Applies it again.
    #[default]
    Hold,
    /// Applies no force beyond this age.
    Zero(Duration),
}

impl OnStale {
    /// Returns whether an action of this age is applied.
    pub fn allows(self, age: Duration) -> bool {
        match self {
            Self::Hold => true,
            Self::Zero(limit) => age <= limit,
        }
    }
}

impl fmt::Display for OnStale {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Hold => f.write_str("hold"),
            Self::Zero(limit) => write!(f, "zero:{}", to_millis(*limit)),
        }
    }
}

impl FromStr for OnStale {
    type Err = ParameterError;

    fn from_str(text: &str) -> Result<Self, ParameterError> {
        if text.trim() == "hold" {
            return Ok(Self::Hold);
        }
        let limit = text
            .trim()
            .strip_prefix("zero:")
            .filter(|limit| *limit != "none")
            .map(str::parse);
        match limit {
            Some(Ok(Draw::Constant(limit))) => Ok(Self::Zero(limit)),
            _ => Err(ParameterError::OnStale(text.to_owned())),
        }
    }
}

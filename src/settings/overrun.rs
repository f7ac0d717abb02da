//! What becomes of due times that pass while a node is busy.

use std::{fmt, str::FromStr, time::Duration};

use super::error::SettingError;
use crate::time::Hz;

/// The name of each policy in text; `queue:N` has the number behind it.
const SKIP: &str = "skip";
const CATCH_UP: &str = "catch-up";
const QUEUE: &str = "queue:";

/// What becomes of due times that pass while a node is busy.
///
/// | text | due times that have passed | as |
/// |---|---|---|
/// | `skip` | are overruns | a timer of ROS |
/// | `queue:N` | wait for up to N periods; earlier ones are overruns | a timer with a queue |
/// | `catch-up` | all wait, and then follow without a pause | a loop that sleeps until the next of its due times |
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Overrun {
    /// For how many periods a due time waits.
    periods: u32,
}

impl Overrun {
    /// Returns how long a due time waits for a node of this rate: up to a nanosecond more, because
    /// due times are rounded to that.
    pub(crate) fn patience(self, hz: Hz) -> Duration {
        let rounding = Duration::from_nanos(self.periods.min(1).into());
        hz.period().saturating_mul(self.periods) + rounding
    }
}

impl fmt::Display for Overrun {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.periods {
            0 => f.write_str(SKIP),
            u32::MAX => f.write_str(CATCH_UP),
            periods => write!(f, "{QUEUE}{periods}"),
        }
    }
}

impl FromStr for Overrun {
    type Err = SettingError;

    fn from_str(text: &str) -> Result<Self, SettingError> {
        let periods = match text.trim() {
            SKIP => Some(0),
            CATCH_UP => Some(u32::MAX),
            text => text
                .strip_prefix(QUEUE)
                .and_then(|count| count.parse().ok()),
        };
        periods
            .map(|periods| Self { periods })
            .ok_or_else(|| SettingError::Overrun(text.to_owned()))
    }
}

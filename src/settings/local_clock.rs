//! A node's own clock, with an error, and the stamps that it gives.

use std::{fmt, str::FromStr, time::Duration};

use super::error::{MAX_DRIFT_PPM, MAX_OFFSET_MS, SettingError};
use crate::{
    sync::{
        Mutex,
        atomic::{AtomicBool, Ordering},
        lock,
    },
    time::Time,
};

/// A drift of one, in units of 10⁻¹².
const ONE: i128 = 1_000_000_000_000;

/// The longest step (ms).
const MAX_STEP_MS: f64 = 1e6;

/// The error of a clock, as text `OFFSET_MS DRIFT_PPM [STEP_MS]`; kept exactly, to the nanosecond
/// and to the millionth of a ppm. A clock with a step shows multiples of it alone, as one that
/// learns the time from messages: `0 0 10` is the time of a simulator that publishes `/clock` at
/// 100 Hz.
///
/// ```
/// use ratelab::ClockError;
///
/// let error: ClockError = "-2.5 40".parse()?;
/// assert_eq!(error.to_string(), "-2.5 40");
/// assert_eq!("0 0 10".parse::<ClockError>()?.to_string(), "0 0 10");
/// # Ok::<(), ratelab::SettingError>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct ClockError {
    /// Lead of the clock (ns).
    offset: i64,
    /// Excess of its speed (10⁻¹²).
    drift: i64,
    /// What its readings are multiples of (ns); zero for each nanosecond.
    step: i64,
}

impl fmt::Display for ClockError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (offset, drift) = (self.offset as f64 / 1e6, self.drift as f64 / 1e6);
        write!(f, "{offset} {drift}")?;
        match self.step {
            0 => Ok(()),
            step => write!(f, " {}", step as f64 / 1e6),
        }
    }
}

impl FromStr for ClockError {
    type Err = SettingError;

    fn from_str(text: &str) -> Result<Self, SettingError> {
        let words: Vec<&str> = text.split_whitespace().collect();
        let known = match words[..] {
            [offset, drift] => Self::from_words(offset, drift, "0"),
            [offset, drift, step] => {
                Self::from_words(offset, drift, step).filter(|error| error.step > 0)
            }
            _ => None,
        };
        known.ok_or_else(|| SettingError::Clock(text.to_owned()))
    }
}

impl ClockError {
    /// Returns the first run time at which a clock with this error since run time zero shows
    /// `shown` or more.
    pub fn when(self, shown: Time) -> Time {
        LocalClock::new(Time::ZERO, self).when(shown)
    }

    /// Returns the time between two readings; zero for a clock that shows each nanosecond.
    pub fn step(self) -> Duration {
        Duration::from_nanos(self.step.unsigned_abs())
    }

    fn from_words(offset: &str, drift: &str, step: &str) -> Option<Self> {
        Some(Self {
            offset: millionths(offset, MAX_OFFSET_MS)?,
            drift: millionths(drift, MAX_DRIFT_PPM)?,
            step: millionths(step, MAX_STEP_MS)?,
        })
    }
}

fn millionths(text: &str, largest: f64) -> Option<i64> {
    let value: f64 = text.parse().ok()?;
    let known = (-largest..=largest).contains(&value);
    known.then(|| (value * 1e6).round() as i64)
}

/// A clock with an error since a given run time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(crate) struct LocalClock {
    since: Time,
    /// Its error.
    pub error: ClockError,
}

impl LocalClock {
    /// Creates a clock with this `error` since a run time.
    pub fn new(since: Time, error: ClockError) -> Self {
        Self { since, error }
    }

    /// Returns the clock's reading at run time `now`; zero for negative readings.
    pub fn shows(self, now: Time) -> Time {
        time(self.reading(now.as_nanos().into()))
    }

    /// Returns the clock's reading at a run time (ns).
    fn reading(self, now: i128) -> i128 {
        let drift = i128::from(self.error.drift);
        let passed = now - i128::from(self.since.as_nanos());
        let exact = now + i128::from(self.error.offset) + (passed * drift).div_euclid(ONE);
        exact - exact.rem_euclid(self.step())
    }

    fn step(self) -> i128 {
        i128::from(self.error.step.max(1))
    }

    /// Returns the first run time since the error began at which the clock shows `shown` or more.
    pub fn when(self, shown: Time) -> Time {
        let since = i128::from(self.since.as_nanos());
        let shown = i128::from(shown.as_nanos());
        let reached = shown + (-shown).rem_euclid(self.step());
        let ahead = reached - since - i128::from(self.error.offset);
        let rate = ONE + i128::from(self.error.drift);
        let passed = -(-ahead.max(0) * ONE).div_euclid(rate);
        time(since + passed)
    }

    /// Returns the earliest reading that is new at run time `now`: the one after the last reading
    /// before `now`.
    pub fn first_reading_at(self, now: Time) -> Time {
        let nanos = now.as_nanos().into();
        if now > self.since {
            time(self.reading(nanos - 1) + 1)
        } else {
            time(self.reading(nanos))
        }
    }
}

fn time(nanos: i128) -> Time {
    Time::from_nanos(u64::try_from(nanos.max(0)).unwrap_or(u64::MAX))
}

/// The clock by which a node stamps its messages: run time, until it gets one of its own.
#[derive(Debug, Default)]
pub(crate) struct StampClock {
    is_own: AtomicBool,
    clock: Mutex<LocalClock>,
}

impl StampClock {
    /// Shows what `clock` shows from now on.
    pub(crate) fn set(&self, clock: LocalClock) {
        *lock(&self.clock) = clock;
        self.is_own.store(true, Ordering::Relaxed);
    }

    /// Returns what it shows at run time `now`.
    #[inline]
    pub(crate) fn shows(&self, now: Time) -> Time {
        if self.is_own.load(Ordering::Relaxed) {
            lock(&self.clock).shows(now)
        } else {
            now
        }
    }
}

//! Exact time: integer nanoseconds since the start of a run, and validated rates.
//!
//! Two nodes that are due at the same instant must be due at the *same* instant.
//! Floating-point seconds cannot guarantee that, so run time is an integer and a rate is
//! an exact fraction.

use std::{
    fmt,
    ops::{Add, Sub},
    str::FromStr,
    time::Duration,
};

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Nanoseconds in a second.
const NANOS: u64 = 1_000_000_000;

/// A moment of a run: nanoseconds since the run began.
///
/// ```
/// use ratelab::Time;
/// use std::time::Duration;
///
/// let t = Time::from_nanos(20_000_000);
/// assert_eq!(t + Duration::from_millis(5) - t, Duration::from_millis(5));
/// assert_eq!(t.to_string(), "0.020 s");
/// ```
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct Time(u64);

impl Time {
    /// The beginning of a run.
    pub const ZERO: Self = Self(0);

    /// Later than any run lasts (584 years): for a run without an end.
    pub const MAX: Self = Self(u64::MAX);

    /// The smallest step of run time: one nanosecond.
    pub const RESOLUTION: Duration = Duration::from_nanos(1);

    /// Returns the moment `nanos` nanoseconds into the run.
    pub const fn from_nanos(nanos: u64) -> Self {
        Self(nanos)
    }

    /// Nanoseconds since the run began.
    pub const fn as_nanos(self) -> u64 {
        self.0
    }

    /// Returns the moment `seconds` into the run, to the nearest nanosecond.
    ///
    /// # Errors
    /// [`TimeError`] if `seconds` is negative, not a number, or beyond
    /// [`Time::MAX`].
    pub fn from_secs_f64(seconds: f64) -> Result<Self, TimeError> {
        let duration = Duration::try_from_secs_f64(seconds).map_err(|_| TimeError(seconds))?;
        let nanos = u64::try_from(duration.as_nanos()).map_err(|_| TimeError(seconds))?;
        Ok(Self(nanos))
    }

    /// Seconds since the run began, as the nearest `f64`.
    pub fn as_secs_f64(self) -> f64 {
        self.0 as f64 / NANOS as f64
    }

    /// Returns the time elapsed since `earlier`; zero if `earlier` is later.
    ///
    /// Under the real clock two threads may stamp and read in either order, so this never
    /// fails.
    pub const fn since(self, earlier: Self) -> Duration {
        Duration::from_nanos(self.0.saturating_sub(earlier.0))
    }
}

impl Add<Duration> for Time {
    type Output = Self;

    /// Saturates at [`Time::MAX`].
    fn add(self, duration: Duration) -> Self {
        let nanos = u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX);
        Self(self.0.saturating_add(nanos))
    }
}

impl Sub<Duration> for Time {
    type Output = Self;

    /// Saturates at [`Time::ZERO`].
    fn sub(self, duration: Duration) -> Self {
        let nanos = u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX);
        Self(self.0.saturating_sub(nanos))
    }
}

impl Sub for Time {
    type Output = Duration;

    /// Saturates at zero, like [`Time::since`].
    fn sub(self, earlier: Self) -> Duration {
        self.since(earlier)
    }
}

impl fmt::Display for Time {
    /// Seconds to the millisecond.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.3} s", self.as_secs_f64())
    }
}

/// A stretch of run time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TimeSpan {
    /// Its begin.
    pub from: Time,
    /// Its end.
    pub to: Time,
}

impl TimeSpan {
    /// Creates the stretch between two moments.
    pub const fn new(from: Time, to: Time) -> Self {
        Self { from, to }
    }

    /// Returns its length; zero if its end is before its begin.
    pub fn length(self) -> Duration {
        self.to.since(self.from)
    }
}

/// A number of seconds that is not a valid run time.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[error("{0} is not a time: expected seconds, zero or more, up to 584 years")]
pub struct TimeError(f64);

/// A rate in ticks per second, kept exactly as whole microhertz.
///
/// Accepted are [`Hz::MIN`] to [`Hz::MAX`]; values are rounded to six decimals, so 33.3
/// Hz means exactly 333 ticks in ten seconds.
///
/// ```
/// use ratelab::Hz;
///
/// assert_eq!(Hz::new(33.3)?, "33.3".parse()?);
/// assert_eq!(
///     Hz::new(0.0).unwrap_err().to_string(),
///     r#""0" is not a rate: expected 0.001 to 10000 ticks per second"#
/// );
/// # Ok::<(), ratelab::HzError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct Hz(u64);

impl Hz {
    /// The slowest rate: one tick in a thousand seconds.
    pub const MIN: Self = Self(1_000);

    /// The fastest rate: 10 kHz, about the limit at which a general-purpose kernel wakes
    /// a thread on time.
    pub const MAX: Self = Self(10_000_000_000);

    /// Validates a rate in ticks per second.
    ///
    /// # Errors
    /// [`HzError`] if `hz` is not a number or outside [`Hz::MIN`] to
    /// [`Hz::MAX`].
    pub fn new(hz: f64) -> Result<Self, HzError> {
        let micro = (hz * 1e6).round();
        // A NaN fails both comparisons and is refused.
        if micro >= Self::MIN.0 as f64 && micro <= Self::MAX.0 as f64 {
            Ok(Self(micro as u64))
        } else {
            Err(HzError(hz.to_string()))
        }
    }

    /// Returns ticks per second.
    pub fn get(self) -> f64 {
        self.0 as f64 / 1e6
    }

    /// Whole microhertz.
    pub const fn as_micro(self) -> u64 {
        self.0
    }

    /// Creates the rate of `micro` microhertz; the nearest rate if that is outside
    /// [`Hz::MIN`] to [`Hz::MAX`].
    ///
    /// ```
    /// use ratelab::Hz;
    ///
    /// assert_eq!(Hz::from_micro(Hz::MAX.as_micro()), Hz::MAX);
    /// assert_eq!(Hz::from_micro(0), Hz::MIN); // A rate always has a period.
    /// ```
    pub fn from_micro(micro: u64) -> Self {
        Self(micro.clamp(Self::MIN.0, Self::MAX.0))
    }

    /// Returns one period, rounded down to a nanosecond. For display and reference lines only:
    /// deadlines come from [`Rate`](crate::Rate), which rounds once.
    pub const fn period(self) -> Duration {
        Duration::from_nanos(NANOS * 1_000_000 / self.0)
    }
}

impl TryFrom<f64> for Hz {
    type Error = HzError;

    fn try_from(hz: f64) -> Result<Self, HzError> {
        Self::new(hz)
    }
}

impl From<Hz> for f64 {
    fn from(hz: Hz) -> Self {
        hz.get()
    }
}

impl fmt::Display for Hz {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} Hz", self.get())
    }
}

impl FromStr for Hz {
    type Err = HzError;

    fn from_str(text: &str) -> Result<Self, HzError> {
        let hz: f64 = text.trim().parse().map_err(|_| HzError(text.to_owned()))?;
        Self::new(hz).map_err(|_| HzError(text.to_owned()))
    }
}

/// An invalid rate, as it was given.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error(
    "{0:?} is not a rate: expected {min} to {max} ticks per second",
    min = Hz::MIN.get(),
    max = Hz::MAX.get()
)]
pub struct HzError(String);

#[cfg(test)]
mod tests {
    use super::*;

    const NO_NUMBERS: [f64; 5] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1.0, f64::MAX];

    #[test]
    fn an_invalid_rate_or_time_is_refused_with_value_and_range() {
        for wrong in "NaN inf -inf 0 -0 -50 1e-9 0.0009 10001 1e300 fast ".split(' ') {
            let error = wrong.parse::<Hz>().expect_err(wrong).to_string();
            let expected =
                format!("{wrong:?} is not a rate: expected 0.001 to 10000 ticks per second");
            assert_eq!(error, expected);
        }
        for wrong in NO_NUMBERS.into_iter().chain([0.0]) {
            let error = Hz::new(wrong).expect_err("refused").to_string();
            assert!(
                error.contains(&wrong.to_string()) && error.contains("0.001 to 10000"),
                "{error}"
            );
        }
        for wrong in NO_NUMBERS.into_iter().chain([-1e-3, 1e11]) {
            let error = Time::from_secs_f64(wrong).expect_err("refused").to_string();
            let expected = "is not a time: expected seconds, zero or more, up to 584 years";
            assert_eq!(error, format!("{wrong} {expected}"));
        }
    }

    #[test]
    fn the_slowest_and_the_fastest_rate_are_accepted() {
        assert_eq!(Hz::new(0.001), Ok(Hz::MIN));
        assert_eq!(Hz::new(10_000.0), Ok(Hz::MAX));
        assert_eq!(" 33.3 ".parse(), Hz::new(33.3));
    }

    #[test]
    fn times_saturate_instead_of_wrapping() {
        assert_eq!(Time::MAX + Time::RESOLUTION, Time::MAX);
        assert!(Time::ZERO.since(Time::from_nanos(1)).is_zero());
        assert!((Time::ZERO - Time::from_nanos(1)).is_zero());
    }
}

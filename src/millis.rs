//! Durations as texts and numbers of milliseconds.

use std::time::Duration;

use serde::{Deserialize, Deserializer, Serializer, de::Error as _};
use thiserror::Error;

/// The longest duration: eleven and a half days, longer than any useful wait.
const MAX_MS: f64 = 1e9;

/// Parses a duration in milliseconds, rounded to the nearest nanosecond.
///
/// # Errors
/// [`MillisError`] for an invalid text.
pub fn parse(text: &str) -> Result<Duration, MillisError> {
    let millis: Option<f64> = text.trim().parse().ok();
    millis
        .and_then(from_millis)
        .ok_or_else(|| MillisError(text.to_owned()))
}

/// A text that is not a duration in milliseconds.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{0:?} is not a duration: expected milliseconds, 0 to {MAX_MS}")]
pub struct MillisError(String);

/// Returns `None` for a negative, too long or non-finite number.
pub fn from_millis(millis: f64) -> Option<Duration> {
    let known = (0.0..=MAX_MS).contains(&millis);
    known.then(|| Duration::from_nanos((millis * 1e6).round() as u64))
}

/// Milliseconds as a number that reads back to the same nanosecond.
pub fn to_millis(duration: Duration) -> f64 {
    duration.as_nanos() as f64 / 1e6
}

/// Writes a number of milliseconds for people, in tenths; below a millisecond with three digits.
///
/// ```
/// use ratelab::millis::text;
///
/// let texts = [0.0, 0.0981, 0.9996, 1.0, 34.96].map(text);
/// assert_eq!(texts, ["0.0", "0.098", "1.0", "1.0", "35.0"]);
/// ```
pub fn text(ms: f64) -> String {
    let thousandths = (ms * 1e3).round().abs();
    if thousandths > 0.0 && thousandths < 1e3 {
        format!("{ms:.3}")
    } else {
        format!("{ms:.1}")
    }
}

/// For serde: as a number of milliseconds.
pub fn serialize<S: Serializer>(duration: &Duration, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_f64(to_millis(*duration))
}

/// For serde.
pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Duration, D::Error> {
    let millis = f64::deserialize(deserializer)?;
    from_millis(millis).ok_or_else(|| D::Error::custom("expected milliseconds, zero or more"))
}

//! Durations as texts and numbers of milliseconds.

use std::time::Duration;

use serde::{Deserialize, Deserializer, Serializer, de::Error};

/// The longest duration: eleven and a half days, longer than any useful wait.
const LONGEST_MS: f64 = 1e9;

/// Parses a duration in milliseconds, rounded to the nearest nanosecond.
///
/// # Errors
/// A message for an invalid text.
pub fn parse(text: &str) -> Result<Duration, String> {
    let millis: Option<f64> = text.trim().parse().ok();
    millis.and_then(from_millis).ok_or_else(|| {
        format!("{text:?} is not a duration: expected milliseconds, 0 to {LONGEST_MS}")
    })
}

/// Returns `None` for a negative, too long or non-finite number.
pub fn from_millis(millis: f64) -> Option<Duration> {
    let known = (0.0..=LONGEST_MS).contains(&millis);
    known.then(|| Duration::from_nanos((millis * 1e6).round() as u64))
}

/// Milliseconds as a number that reads back to the same nanosecond.
pub fn to_millis(duration: Duration) -> f64 {
    duration.as_nanos() as f64 / 1e6
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

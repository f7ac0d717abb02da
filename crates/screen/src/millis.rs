//! Durations in whole milliseconds.

use std::time::Duration;

/// Such as `20 ms`; half a millisecond goes to the even number.
pub fn ms(duration: Duration) -> String {
    format!("{} ms", number(duration))
}

/// Such as `20`, rounded in the same way.
pub fn number(duration: Duration) -> String {
    format!("{:.0}", duration.as_secs_f64() * 1e3)
}

/// As a number to count with; half a millisecond counts as one.
pub fn whole(duration: Duration) -> u128 {
    (duration.as_micros() + 500) / 1_000
}

//! Durations in whole milliseconds; below a millisecond with three digits.

use std::time::Duration;

use ratelab::millis;

/// Such as `20 ms` or `0.350 ms`; half a millisecond above one goes to the even number.
pub fn ms(duration: Duration) -> String {
    format!("{} ms", number(duration))
}

/// Such as `20` or `0.350`, rounded in the same way.
pub fn number(duration: Duration) -> String {
    let ms = millis::to_millis(duration);
    if duration.is_zero() || ms >= 0.9995 {
        format!("{ms:.0}")
    } else {
        millis::text(ms)
    }
}

/// Returns the mean of `durations`; `None` without any.
pub fn mean(durations: impl Iterator<Item = Duration>) -> Option<Duration> {
    let (sum, count) = durations.fold((Duration::ZERO, 0), |(sum, count), duration| {
        (sum + duration, count + 1)
    });
    (count > 0).then(|| sum / count)
}

/// As a number to count with; half a millisecond counts as one.
pub fn whole(duration: Duration) -> u128 {
    (duration.as_micros() + 500) / 1_000
}

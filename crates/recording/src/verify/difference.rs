//! A difference and its place.

use ratelab::Time;
use thiserror::Error;

/// The first thing that is not the same.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("differs at {at}: {what}: recorded {recorded}, computed {computed}")]
pub struct Difference {
    /// Run time of it.
    pub at: Time,
    /// The item.
    pub what: String,
    /// The recorded value.
    pub recorded: String,
    /// The value of the new run.
    pub computed: String,
}

impl Difference {
    /// Of what was `recorded` and is `computed`, at run time `at`.
    pub fn new(at: Time, what: impl Into<String>, [recorded, computed]: [String; 2]) -> Self {
        Self {
            at,
            what: what.into(),
            recorded,
            computed,
        }
    }

    /// Returns the first of `parts` that is not as it was recorded.
    pub fn first(parts: impl IntoIterator<Item = Self>) -> Option<Self> {
        parts
            .into_iter()
            .find(|part| part.recorded != part.computed)
    }
}

/// Returns a run time to the nanosecond.
pub fn nanos(time: Time) -> String {
    format!("{} ns", time.as_nanos())
}

/// Returns a number to the bit.
pub fn bits(value: f64) -> String {
    format!("{value:?} ({:#018x})", value.to_bits())
}

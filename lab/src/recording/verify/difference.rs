//! A difference and its place.

use std::fmt;

use ratelab::Time;

/// The first thing that is not the same.
#[derive(Clone, Debug, PartialEq)]
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

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            at,
            what,
            recorded,
            computed,
        } = self;
        write!(
            f,
            "differs at {at}: {what}: recorded {recorded}, computed {computed}"
        )
    }
}

/// A part of a run in words: its name, as it was recorded, and as it was computed.
pub type ComparedPart = (String, String, String);

impl Difference {
    /// The first of `parts` that is not as it was recorded, at run time `at`.
    pub fn first(at: Time, parts: impl IntoIterator<Item = ComparedPart>) -> Option<Self> {
        let mut parts = parts.into_iter();
        let (what, recorded, computed) = parts.find(|(_, one, other)| one != other)?;
        Some(Self {
            at,
            what,
            recorded,
            computed,
        })
    }
}

/// A run time to the nanosecond.
pub fn nanos(time: Time) -> String {
    format!("{} ns", time.as_nanos())
}

/// A number to the bit.
pub fn bits(value: f64) -> String {
    format!("{value:?} ({:#018x})", value.to_bits())
}

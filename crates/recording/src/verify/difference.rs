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
    /// It was `recorded` and is `computed`, at run time `at`.
    pub fn new(at: Time, (what, recorded, computed): ComparedPart) -> Self {
        Self {
            at,
            what,
            recorded,
            computed,
        }
    }

    /// The first of `parts` that is not as it was recorded, at run time `at`.
    pub fn first(at: Time, parts: impl IntoIterator<Item = ComparedPart>) -> Option<Self> {
        let mut parts = parts.into_iter();
        let part = parts.find(|(_, recorded, computed)| recorded != computed)?;
        Some(Self::new(at, part))
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

//! The summary of a run, as text and as JSON. A new figure is a row in each.

pub mod ages;
pub mod json;
pub mod phases;
pub mod text;

/// How many digits the figures of a run have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Digits {
    /// Four decimals, for readers.
    Four,
    /// All that were measured, to be compared with limits.
    All,
}

impl Digits {
    /// Returns `value` with so many digits.
    pub fn round(self, value: f64) -> f64 {
        match self {
            Self::Four => rounded(value),
            Self::All => value,
        }
    }

    /// This number of seconds in milliseconds.
    pub fn ms(self, seconds: f64) -> f64 {
        match self {
            Self::Four => rounded(seconds * 1e3),
            // By way of nanoseconds, which are whole: fewer last digits are noise.
            Self::All => seconds * 1e9 / 1e6,
        }
    }
}

/// Rounds to four decimals, as in the course's artifact.
pub fn rounded(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}

//! The summary of a run, as text and as JSON. A new figure is a row in each.

pub mod ages;
pub mod json;
pub mod phases;
pub mod text;

/// Rounds to four decimals, as in the course's artifact.
pub fn rounded(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}

//! The states of a plant as rows of text.

use ratelab::Time;

/// The format of a system's states as comma-separated values, for systems with a format
/// of their own.
#[derive(Clone, Copy, Debug)]
pub struct StateTable {
    /// Comma-separated names of the columns.
    pub header: &'static str,
    /// Writes a row from run time and state.
    pub row: fn(Time, &[f64]) -> String,
}

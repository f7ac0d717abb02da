//! The states of a plant as rows of text.

use crate::runtime::Time;

/// How the states of a system are written as comma-separated values, for a system
/// that has a form of its own.
#[derive(Clone, Copy, Debug)]
pub struct Table {
    /// Names of the columns, with commas in between.
    pub header: &'static str,
    /// A row, from run time and state.
    pub row: fn(Time, &[f64]) -> String,
}

//! A limit for a figure of a run.

use std::fmt;

/// A limit for a figure of a run, which `ratelab check` compares it with.
#[derive(Clone, Debug, PartialEq)]
pub struct FigureLimit {
    /// The figure, by its place in the metrics of a run, such as `nodes.detector.overruns`.
    pub figure: String,
    /// What it may be.
    pub bound: Bound,
    /// Line and column of its section in the graph file, counted from one.
    pub place: [usize; 2],
}

/// What a figure may be, in its own unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    /// This, or less.
    AtMost(f64),
    /// This, or more.
    AtLeast(f64),
}

/// By how much a figure may be beyond its bound, as a share of that: some last digits of a double,
/// which its sums and divisions round.
const ROUNDING: f64 = 1e-14;

impl Bound {
    /// Returns whether `value` is within it. A figure that is equal to it is, however its sums are
    /// rounded.
    pub fn holds(self, value: f64) -> bool {
        match self {
            Self::AtMost(most) => value <= most + most.abs() * ROUNDING,
            Self::AtLeast(least) => value >= least - least.abs() * ROUNDING,
        }
    }
}

impl fmt::Display for FigureLimit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.bound {
            Bound::AtMost(most) => write!(f, "{} at most {most}", self.figure),
            Bound::AtLeast(least) => write!(f, "{} at least {least}", self.figure),
        }
    }
}

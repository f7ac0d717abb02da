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
    /// Whether `value` is within it. A figure that is equal to it is, however its sums are rounded.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_at_its_bound_is_within_it_however_its_sums_are_rounded() {
        for (bound, value, holds) in [
            (Bound::AtMost(26.2), 26.2, true),
            (Bound::AtMost(26.2), 26.200_000_000_000_003, true),
            (Bound::AtMost(26.2), 26.200_000_000_01, false),
            (Bound::AtLeast(0.9), 0.899_999_999_999_999_9, true),
            (Bound::AtLeast(0.9), 0.899_999_999_99, false),
            (Bound::AtMost(-61.2), -61.199_999_999_999_996, true),
            (Bound::AtMost(0.0), 0.0, true),
            (Bound::AtMost(0.0), f64::MIN_POSITIVE, false),
            (Bound::AtMost(0.0), f64::NAN, false),
            (Bound::AtLeast(1e12), 1e12 - 1.0, false),
        ] {
            assert_eq!(bound.holds(value), holds, "{bound:?} {value}");
        }
    }
}

//! A policy that chooses one of two pushes.

use crate::{Moment, PolicyFault, RowPolicy};

/// Pushes with all it has: to the one side if the first of two values is the greater one, to the other
/// side if it is the second.
pub(crate) struct Choice {
    values: Box<dyn RowPolicy>,
    push: [f64; 1],
}

impl Choice {
    /// Creates one that follows these values.
    pub(crate) fn new(values: Box<dyn RowPolicy>) -> Self {
        Self {
            values,
            push: [0.0],
        }
    }
}

impl RowPolicy for Choice {
    fn start(&mut self) -> Result<(), PolicyFault> {
        self.values.start()
    }

    fn begin(&mut self, moment: Moment) {
        self.values.begin(moment);
    }

    fn answer(&mut self, observation: &[f64]) -> &[f64] {
        self.push = match self.values.answer(observation) {
            [first, second] if first.is_finite() && second.is_finite() => {
                [if second > first { 1.0 } else { -1.0 }]
            }
            _ => [f64::NAN],
        };
        &self.push
    }
}

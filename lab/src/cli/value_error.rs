//! The error of an option's value.

use thiserror::Error;

/// Why a value of an option is refused: what was expected.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ValueError {
    /// A seed.
    #[error("expected a whole number from 0 to {}", u64::MAX)]
    Seed,
    /// The size of a screen.
    #[error("expected columns x rows, 40x12 to 400x200, such as 120x35")]
    Size,
    /// A number in a range.
    #[error("expected {min} to {max} {unit}")]
    Range {
        /// The least number.
        min: String,
        /// The greatest number.
        max: String,
        /// The unit.
        unit: String,
    },
    /// The step of the physics.
    #[error("expected 1, 2, 5 or 10 milliseconds")]
    Step,
    /// A node with a value, which has this form.
    #[error("expected NODE={0}")]
    NodeValue(String),
    /// The speed of virtual time.
    #[error("expected max, or 0.1 to 100 times wall time")]
    Speed,
    /// A speed that is a number.
    #[error("expected 0.1 to 100 times wall time")]
    Pace,
    /// The number of an exercise.
    #[error("expected one of {0}")]
    Exercise(String),
    /// The number of an exercise, or the word `check`.
    #[error("expected one of {0}, or check")]
    ExerciseOrCheck(String),
    /// A knob that the library refuses, with its reason.
    #[error("{0}")]
    Refused(String),
}

impl ValueError {
    /// Creates the error for a refusal by the library.
    pub fn refused(reason: impl ToString) -> Self {
        Self::Refused(reason.to_string())
    }
}

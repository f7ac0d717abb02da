//! What all exercises have in common: an objective, a prediction, a
//! measurement, and bands that the measurement must stay within.

mod answers;
mod exercise;
mod expectations;
mod prediction;
mod recorded;
mod table;
mod unit;

pub use answers::{Answers, AnswersError};
pub use exercise::{Answer, Brief, Exercise, Failure, Findings, Kind, Measurement};
pub use expectations::{Check, Expectation, Expectations, ExpectationsError};
pub use prediction::{Prediction, PredictionError, Range};
pub use table::Table;

pub(crate) use exercise::{hz, mean_ms};
pub(crate) use recorded::{Recorded, record};

//! The common parts of all exercises: an objective, a prediction, a measurement, and
//! bands for the measurement.

mod answers;
mod brief;
mod chance;
mod entry;
mod exercise;
mod expectations;
mod mark;
mod measurement;
mod prediction;
mod recorded;
mod survey;
mod table;
mod tolerance;
mod unit;

pub use answers::{Answers, AnswersError};
pub use brief::{Brief, ExerciseKind, Range};
pub use exercise::{Answer, Exercise, Failure, Findings};
pub use expectations::{Check, Expectation, Expectations, ExpectationsError};
pub use mark::PredictionOrigin;
pub use measurement::Measurement;
pub use prediction::{Prediction, PredictionError};
pub use table::Table;
pub use tolerance::Tolerance;

pub(crate) use chance::SplitMix;
pub(crate) use exercise::{hz, mean_ms};
pub(crate) use recorded::{RecordedRun, axis, cart_pole, own_world, record};
pub(crate) use survey::{KnobRuns, push_age_ms, survey};

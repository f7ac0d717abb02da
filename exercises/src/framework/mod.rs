//! The common parts of all exercises: an objective, a prediction, a measurement, and
//! bands for the measurement.

mod answers;
mod brief;
mod exercise;
mod expectations;
mod prediction;
mod runs;
mod unit;

pub use answers::{Answers, AnswersError, PredictionOrigin};
pub use brief::{Brief, PredictionPlace, Range, Replies, Tolerance};
pub use exercise::{Answer, Exercise, Failure, Findings};
pub use expectations::{Check, Expectation, Expectations, ExpectationsError, Measurement};
pub use prediction::{Prediction, PredictionError};

pub(crate) use ratelab_experiment::Table;

pub(crate) use exercise::{Measure, hz, mean_ms};
pub(crate) use runs::{
    KnobRuns, RecordedRun, angle_deg, asked, cart_pole, control_loop, edge, obs_dropped, own_world,
    record, survey, survey_of, widest_deg,
};
pub(crate) use unit::SplitMix;

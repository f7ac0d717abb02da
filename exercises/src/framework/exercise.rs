//! An exercise: what is asked, what is measured, what it means.

use ratelab::{
    cartpole::PlantError,
    experiment::sweep::{AxisError, SweepError},
    runtime::{Fault, Hz, HzError, TimeError},
    stability::StabilityError,
    system::{BuildError, KnobTextError},
};
use thiserror::Error;

use super::{
    brief::{Brief, in_unit},
    expectations::{Check, Expectations, ExpectationsError},
    measurement::Measurement,
    prediction::Prediction,
    table::Table,
};

/// One exercise.
pub trait Exercise: Sync {
    /// What is asked.
    fn brief(&self) -> &'static Brief;

    /// Measures everything now.
    ///
    /// # Errors
    /// [`Failure`] if a run could not be made; a pole that falls is a result.
    fn run(&self) -> Result<Findings, Failure>;

    /// Measures everything and puts it beside its bands.
    ///
    /// # Errors
    /// [`Failure`] if a run could not be made or the bands are damaged. A band
    /// that does not hold is a [`Check`] that does not.
    fn check(&self) -> Result<Vec<Check>, Failure> {
        self.run()?.checks(self.brief())
    }
}

/// What an exercise measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Findings {
    /// The figures as a learner reads them.
    pub table: Table,
    /// The answer to the question.
    pub answer: Answer,
    /// What the figures mean, made from them.
    pub meaning: String,
    /// The figures that must lie in bands.
    pub measurements: Vec<Measurement>,
}

/// What the measurement has to say on the question.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Answer {
    /// This number, in the unit of the question.
    Exactly(f64),
    /// It turned somewhere between two numbers that were tried.
    Between {
        /// Where all was still well.
        held: f64,
        /// Where it was not any more.
        failed: f64,
    },
}

impl Answer {
    /// How a predicted `number` in `unit` compares, and whether it is right.
    fn judge(self, number: f64, unit: &str) -> (bool, String) {
        let (near, far) = match self {
            Self::Exactly(measured) => (measured, measured),
            Self::Between { held, .. } if number == held => {
                let held = in_unit(held, unit);
                return (false, format!("Just missed: at {held} all was still well."));
            }
            Self::Between { held, failed } => (held.min(failed), held.max(failed)),
        };
        let distance = number - number.clamp(near, far);
        let way = if distance > 0.0 { "above" } else { "below" };
        let missed = format!("{} {way} it", in_unit(rounded(distance.abs()), unit));
        match distance.abs() {
            0.0 => (true, "You called it.".to_owned()),
            small if small <= CLOSE * far.abs() => (false, format!("Close: {missed}.")),
            _ => (false, format!("You were {missed}.")),
        }
    }
}

/// To four decimals, which is more than anyone predicts.
fn rounded(number: f64) -> f64 {
    (number * 1e4).round() / 1e4
}

/// Share of the measured number by which a prediction may miss it and still be
/// called close.
const CLOSE: f64 = 0.1;

impl Findings {
    /// What was measured beside its bands.
    ///
    /// # Errors
    /// [`Failure`] if the bands are damaged.
    pub fn checks(&self, brief: &Brief) -> Result<Vec<Check>, Failure> {
        Ok(Expectations::load()?.compare(brief, &self.measurements)?)
    }

    /// Whether a prediction was right, and by how much it was not.
    pub fn judge(&self, brief: &Brief, prediction: &Prediction) -> (bool, String) {
        self.answer.judge(prediction.number(), brief.unit)
    }

    /// What was predicted beside what was measured, and what that means.
    pub fn reconcile(&self, brief: &Brief, prediction: &Prediction) -> String {
        let unit = |number| brief.in_unit(number);
        let measured = match self.answer {
            Answer::Exactly(number) => unit(rounded(number)),
            Answer::Between { held, failed } => {
                format!("between {} and {}", unit(held), unit(failed))
            }
        };
        format!(
            "You predicted {}: {}.\nMeasured: {measured}. {}\n\n{}",
            unit(prediction.number()),
            prediction.reason().trim_end_matches('.'),
            self.judge(brief, prediction).1,
            self.meaning,
        )
    }
}

/// Why an exercise could not be measured.
#[derive(Debug, Error)]
pub enum Failure {
    /// A run could not be set up.
    #[error(transparent)]
    Setup(#[from] BuildError),
    /// A plant could not be made.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// A node failed.
    #[error(transparent)]
    Fault(#[from] Fault),
    /// A node that was ticked by hand failed.
    #[error("a node failed: {0}")]
    Tick(#[from] Box<dyn std::error::Error + Send + Sync>),
    /// Runs could not be swept.
    #[error(transparent)]
    Sweep(#[from] SweepError),
    /// Theory has no answer.
    #[error(transparent)]
    Theory(#[from] StabilityError),
    /// A rate that is none.
    #[error(transparent)]
    Rate(#[from] HzError),
    /// A knob that is none.
    #[error(transparent)]
    Knob(#[from] KnobTextError),
    /// A list of values that is none.
    #[error(transparent)]
    Axis(#[from] AxisError),
    /// A time that is none.
    #[error(transparent)]
    Time(#[from] TimeError),
    /// The bands cannot be used.
    #[error(transparent)]
    Expectations(#[from] ExpectationsError),
    /// Something that every run of the exercise shows did not show.
    #[error("nothing to measure: {0}")]
    Unmeasured(String),
}

/// A mean in seconds as milliseconds; not a number if there was none.
pub(crate) fn mean_ms(mean_s: Option<f64>) -> f64 {
    mean_s.map_or(f64::NAN, |mean| mean * 1e3)
}

/// Rates of an exercise, which are constants.
pub(crate) fn hz(rates: &[f64]) -> Result<Vec<Hz>, Failure> {
    rates.iter().map(|&hz| Ok(Hz::new(hz)?)).collect()
}

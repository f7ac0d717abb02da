//! An exercise: question, measurement, meaning.

use ratelab::{Fault, Hz, HzError, TimeError};
use ratelab_cart_pole::{PlantError, stability::StabilityError};
use ratelab_experiment::{
    Config, Table,
    sweep::{AxisError, SweepError},
};
use ratelab_plant::PlantDefect;
use ratelab_system::{BuildError, KnobTextError, graph_file::GraphFileError};
use thiserror::Error;

use super::{
    brief::{Brief, PredictionPlace},
    expectations::{Check, Expectations, ExpectationsError, Measurement},
    prediction::Prediction,
    unit::in_unit,
};

/// One question of an exercise: its text, and what measures it.
pub struct Exercise {
    brief: Brief,
    measure: Measure,
}

/// What measures a question.
#[derive(Clone, Copy)]
pub(crate) enum Measure {
    /// For everyone alike.
    Alike(fn() -> Result<Findings, Failure>),
    /// As drawn from the learner's number.
    Drawn(fn(u64) -> Result<Findings, Failure>),
    /// As drawn from the learner's number, too, with the run to look at before the
    /// prediction and its figures.
    Shown {
        measure: fn(&Brief, u64) -> Result<Findings, Failure>,
        scene: fn(u64) -> Result<Config, Failure>,
        evidence: fn(u64) -> Result<Table, Failure>,
    },
}

impl Exercise {
    pub(crate) fn new(brief: Brief, measure: Measure) -> Self {
        Self { brief, measure }
    }

    /// Returns the text of the question.
    pub fn brief(&self) -> &Brief {
        &self.brief
    }

    /// Makes all measurements for the learner's number `seed`, which matters only if the
    /// exercise [draws](Self::draws).
    ///
    /// # Errors
    /// [`Failure`] if a run failed; a fall of the pole is a result.
    pub fn measure(&self, seed: u64) -> Result<Findings, Failure> {
        match self.measure {
            Measure::Alike(measure) => measure(),
            Measure::Drawn(measure) => measure(seed),
            Measure::Shown { measure, .. } => measure(&self.brief, seed),
        }
    }

    /// Returns whether the learner's number decides what is measured.
    pub fn draws(&self) -> bool {
        !matches!(self.measure, Measure::Alike(_))
    }

    /// Figures to look at before the prediction, for the learner's number `seed`.
    ///
    /// # Errors
    /// [`Failure`] if a run failed.
    pub fn evidence(&self, seed: u64) -> Result<Option<Table>, Failure> {
        match self.measure {
            Measure::Shown { evidence, .. } => evidence(seed).map(Some),
            _ => Ok(None),
        }
    }

    /// Returns the run to look at in the lab before the prediction, for the learner's number
    /// `seed`.
    ///
    /// # Errors
    /// [`Failure`] if its settings are invalid.
    pub fn scene(&self, seed: u64) -> Result<Option<Config>, Failure> {
        match self.measure {
            Measure::Shown { scene, .. } => scene(seed).map(Some),
            _ => Ok(None),
        }
    }

    /// Makes all measurements for the number zero.
    ///
    /// # Errors
    /// [`Failure`] if a run failed.
    pub fn run(&self) -> Result<Findings, Failure> {
        self.measure(0)
    }
}

/// The results of an exercise.
#[derive(Clone, Debug, PartialEq)]
pub struct Findings {
    /// The figures for the learner.
    pub table: Table,
    /// Where the prediction stands in it.
    pub place: PredictionPlace,
    /// The answer to the question.
    pub answer: Answer,
    /// The meaning of the figures.
    pub meaning: String,
    /// The figures with bands.
    pub measurements: Vec<Measurement>,
}

/// The measured answer to the question.
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// This number, in the unit of the question.
    Exactly(f64),
    /// Anywhere between these two, such as the last tested number with a good result and
    /// the first with a bad one.
    Between {
        /// The first of them.
        from: f64,
        /// The other.
        to: f64,
    },
    /// One of the choices.
    Choice {
        /// Its number, counted from one.
        number: f64,
        /// For each choice, the figure that refutes it.
        refuted: Vec<String>,
    },
}

impl Answer {
    /// Returns the measured answer in the unit of the question, as text.
    pub fn in_words(&self, brief: &Brief) -> String {
        let unit = |number: f64| brief.in_unit(rounded(number));
        match self {
            Self::Exactly(number) | Self::Choice { number, .. } => unit(*number),
            Self::Between { from, to } => format!("between {} and {}", unit(*from), unit(*to)),
        }
    }

    /// Compares the predicted `number` with it; returns whether it is right, with a text.
    fn judge(&self, number: f64, brief: &Brief) -> (bool, String) {
        let (near, far) = match self {
            Self::Exactly(measured)
            | Self::Choice {
                number: measured, ..
            } => (*measured, *measured),
            Self::Between { from, to } => (from.min(*to), from.max(*to)),
        };
        let distance = number - number.clamp(near, far);
        let way = if distance > 0.0 { "above" } else { "below" };
        let distance = rounded(distance.abs());
        let apart = in_unit(distance, &brief.unit);
        if distance == 0.0 {
            (true, "Correct.".to_owned())
        } else if let Some(figure) = self.refutation(number) {
            (false, figure.clone())
        } else if distance <= brief.tolerance.within() {
            (true, format!("Correct to within {apart}."))
        } else if distance <= CLOSE * far.abs() {
            (false, format!("Close: {apart} {way} it."))
        } else {
            (false, format!("You were {apart} {way} it."))
        }
    }

    /// Returns the figure that refutes choice `number`.
    fn refutation(&self, number: f64) -> Option<&String> {
        match self {
            Self::Choice { refuted, .. } => refuted.get((number as usize).checked_sub(1)?),
            _ => None,
        }
    }
}

/// Rounds to four decimals, more than any prediction has.
fn rounded(number: f64) -> f64 {
    (number * 1e4).round() / 1e4
}

/// The largest relative error of a prediction that still counts as close.
const CLOSE: f64 = 0.1;

impl Findings {
    /// Compares the measurements with their bands: one outside of its band is a [`Check`] that
    /// does not hold.
    ///
    /// # Errors
    /// [`Failure`] if the bands are damaged.
    pub fn checks(&self, brief: &Brief) -> Result<Vec<Check>, Failure> {
        Ok(Expectations::load()?.compare(brief, &self.measurements)?)
    }

    /// Returns whether a prediction is right, with its deviation.
    pub fn judge(&self, brief: &Brief, prediction: &Prediction) -> (bool, String) {
        self.answer.judge(prediction.number(), brief)
    }

    /// Returns the prediction, the measurement, and the meaning of the difference.
    pub fn reconcile(&self, brief: &Brief, prediction: &Prediction) -> String {
        format!("{}\n\n{}", self.outcome(brief, prediction), self.meaning)
    }

    /// Returns the prediction, the measurement, and what is replied, in a line each.
    pub fn outcome(&self, brief: &Brief, prediction: &Prediction) -> String {
        let outcome = format!(
            "You predicted {}: {}.\nMeasured: {}. {}\n{}",
            brief.in_unit(prediction.number()),
            prediction.reason().trim_end_matches('.'),
            self.answer.in_words(brief),
            self.judge(brief, prediction).1,
            self.reply(brief, prediction),
        );
        outcome.trim_end().to_owned()
    }

    /// Returns what is replied to the prediction.
    pub fn reply<'b>(&self, brief: &'b Brief, prediction: &Prediction) -> &'b str {
        let (number, replies) = (prediction.number(), &brief.replies);
        match &self.answer {
            _ if self.judge(brief, prediction).0 => &replies.right,
            Answer::Choice { .. } => &replies.other,
            Answer::Exactly(measured) if number > *measured => &replies.above,
            Answer::Between { from, to } if number > from.max(*to) => &replies.above,
            _ => &replies.below,
        }
    }

    /// Returns the table with the prediction in it, as text.
    pub fn drawn(&self, brief: &Brief, prediction: &Prediction) -> String {
        self.place.drawn(&self.table, prediction.number(), brief)
    }
}

/// An error while measuring an exercise.
#[derive(Debug, Error)]
pub enum Failure {
    /// Building a run failed.
    #[error(transparent)]
    Setup(#[from] BuildError),
    /// Creating a plant failed.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// A node failed.
    #[error(transparent)]
    Fault(#[from] Fault),
    /// A node that was ticked directly failed.
    #[error("a node failed: {0}")]
    Tick(#[from] Box<dyn std::error::Error + Send + Sync>),
    /// A sweep failed.
    #[error(transparent)]
    Sweep(#[from] SweepError),
    /// Linear theory failed.
    #[error(transparent)]
    Theory(#[from] StabilityError),
    /// An invalid rate.
    #[error(transparent)]
    Rate(#[from] HzError),
    /// An invalid knob.
    #[error(transparent)]
    Knob(#[from] KnobTextError),
    /// A graph file that is a part of the program.
    #[error(transparent)]
    Graph(#[from] GraphFileError),
    /// A robot that is a part of the program.
    #[error(transparent)]
    Robot(#[from] PlantDefect),
    /// An invalid list of values.
    #[error(transparent)]
    Axis(#[from] AxisError),
    /// An invalid time.
    #[error(transparent)]
    Time(#[from] TimeError),
    /// The bands are unusable.
    #[error(transparent)]
    Expectations(#[from] ExpectationsError),
    /// An expected effect was absent from the runs.
    #[error("nothing to measure: {0}")]
    Unmeasured(String),
}

/// Returns a mean in milliseconds, from seconds; NaN without samples.
pub(crate) fn mean_ms(mean_s: Option<f64>) -> f64 {
    mean_s.map_or(f64::NAN, |mean| mean * 1e3)
}

/// Returns the rates of an exercise, which are constants.
pub(crate) fn hz(rates: &[f64]) -> Result<Vec<Hz>, Failure> {
    rates.iter().map(|&hz| Ok(Hz::new(hz)?)).collect()
}

//! What a learner expects before the run.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// A number and why: what is predicted before anything is measured. As text:
/// `8 because the pole needs a second to fall`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Unchecked")]
pub struct Prediction {
    number: f64,
    reason: String,
}

impl Prediction {
    /// A prediction of `number`, in the unit of the question.
    ///
    /// # Errors
    /// [`PredictionError`] if the number is none or the reason is empty.
    pub fn new(number: f64, reason: &str) -> Result<Self, PredictionError> {
        let reason = reason.trim();
        if !number.is_finite() {
            return Err(PredictionError::NoNumber(number.to_string()));
        }
        if !reason.contains(char::is_alphanumeric) {
            return Err(PredictionError::NoReason(number));
        }
        Ok(Self {
            number,
            reason: reason.to_owned(),
        })
    }

    /// The number, in the unit of the question.
    pub fn number(&self) -> f64 {
        self.number
    }

    /// Why.
    pub fn reason(&self) -> &str {
        &self.reason
    }
}

impl fmt::Display for Prediction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} because {}", self.number, self.reason)
    }
}

impl FromStr for Prediction {
    type Err = PredictionError;

    /// Reads a number, perhaps its unit, and a reason, which follows the first
    /// `because`, or else the number.
    fn from_str(text: &str) -> Result<Self, PredictionError> {
        let text = text.trim();
        if text.is_empty() {
            return Err(PredictionError::Empty);
        }
        let of_number = |c: char| c.is_ascii_digit() || ".-+".contains(c);
        let end = text.find(|c| !of_number(c)).unwrap_or(text.len());
        let (number, rest) = text.split_at(end);
        let no_number = || PredictionError::NoNumber(text.to_owned());
        let number: f64 = number.parse().map_err(|_| no_number())?;
        let reason = match rest.split_once("because") {
            Some((_unit, reason)) => reason,
            None => rest.trim_start_matches([' ', ',', ':', ';']),
        };
        Self::new(number, reason)
    }
}

/// No prediction.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PredictionError {
    /// Nothing was said.
    #[error("nothing is predicted yet: say a number and why, such as 8 because …")]
    Empty,
    /// It does not begin with a number.
    #[error("{0:?} does not begin with a number: say one and why, such as 8 because …")]
    NoNumber(String),
    /// The number has no reason.
    #[error("{0} is a number without a reason: add one, such as {0} because …")]
    NoReason(f64),
}

/// A prediction as it stands in a file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table with a number and a reason")]
struct Unchecked {
    number: f64,
    reason: String,
}

impl TryFrom<Unchecked> for Prediction {
    type Error = PredictionError;

    fn try_from(read: Unchecked) -> Result<Self, PredictionError> {
        Self::new(read.number, &read.reason)
    }
}

//! Growth by linear theory for each pair of rates of the cart-pole.

use ratelab_cart_pole::stability::{Expected, StabilityError, expected};
use ratelab_experiment::Config;

use crate::error::Error;

/// The prediction of theory for the runs of a row.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RowTheory {
    /// The rate at which a small deviation grows (1/s), or its root mean square with
    /// random loss of messages; `None` without an answer.
    pub growth: Option<f64>,
    /// With random delays: whether deviations shrink for any pattern.
    pub sure: Option<bool>,
    /// Of a policy that answers with chunks: the share of starts that stand for ten seconds.
    pub stands: Option<f64>,
}

impl RowTheory {
    /// Predicts the run of `config` by theory; the prediction is empty if theory has none.
    ///
    /// # Errors
    /// [`Error::Unfinished`] if the plant cannot be linearised.
    pub fn predict(config: &Config) -> Result<Self, Error> {
        let mut theory = Self::default();
        match expected(&config.setup, config.world) {
            Ok(Expected::Growth(growth) | Expected::MeanSquare(growth)) => {
                theory.growth = Some(growth);
            }
            Ok(Expected::Any(sure)) => theory.sure = Some(sure),
            Ok(Expected::Planned(outlook)) => {
                (theory.growth, theory.stands) = (Some(outlook.growth), Some(outlook.stands));
            }
            Err(error @ StabilityError::Plant(_)) => {
                return Err(Error::Unfinished(error.to_string()));
            }
            Err(_) => {}
        }
        Ok(theory)
    }
}

/// An edge between two rows, by theory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Edge {
    /// Small deviations grow on one side.
    Grows,
    /// On one side, small deviations shrink for any pattern of delays.
    Sure,
    /// On one side, half of the starts stand.
    Stands,
}

impl Edge {
    /// All edges.
    pub const ALL: [Self; 3] = [Self::Grows, Self::Sure, Self::Stands];

    /// Returns the edge between two adjacent rows, if any.
    pub fn between(one: RowTheory, next: RowTheory) -> Option<Self> {
        let grows = |row: RowTheory| row.growth.map(|growth| growth >= 0.0);
        let differ = |one: Option<bool>, next: Option<bool>| {
            one.zip(next).is_some_and(|(one, next)| one != next)
        };
        // For a constant delay, stable means stable for any pattern.
        let sure = |row: RowTheory| row.sure.or(grows(row).map(|grows| !grows));
        let stands = |row: RowTheory| row.stands.map(|share| share >= 0.5);
        if differ(stands(one), stands(next)) {
            Some(Self::Stands)
        } else if stands(one).is_some() {
            None
        } else if differ(grows(one), grows(next)) {
            Some(Self::Grows)
        } else {
            differ(sure(one), sure(next)).then_some(Self::Sure)
        }
    }

    /// Returns the meaning of the edge.
    pub fn text(self) -> &'static str {
        match self {
            Self::Grows => {
                "small deviations begin to grow: exact for rates, offsets and constant\n\
                 \x20         delays, and in the mean square for losses. No fall yet: where the motor\n\
                 \x20         gives all it has, the pole may swing and stay; a short run may end before"
            }
            Self::Sure => {
                "no pattern of delays makes deviations grow on one side: sufficient only,\n\
                 \x20         beyond it most patterns are borne"
            }
            Self::Stands => {
                "half of the starts stand: chunks, by what disturbances and the model's error come\n\
                 \x20         to since a reading; it knows no limit of the motor"
            }
        }
    }
}

//! Growth by linear theory for each pair of rates of the cart-pole.

use ratelab::{
    experiment::Config,
    stability::{Expected, NotExpected, StabilityError, expected},
    system::{Setup, WorldKind},
};

use crate::error::Error;

/// What theory says of the runs of a row.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RowTheory {
    /// The growth of a small deviation (1/s), or of the root of its mean square where
    /// messages are lost at random; `None` where there is no answer.
    pub growth: Option<f64>,
    /// Where delays change at random: whether deviations shrink whatever their pattern.
    pub sure: Option<bool>,
}

/// The growth of a small deviation (1/s) by rates; `None` where the hyper-period is too
/// long.
#[derive(Default)]
pub struct Theory(Vec<((Setup, WorldKind), RowTheory)>);

impl Theory {
    /// What it says of the run that `config` is.
    ///
    /// # Errors
    /// [`Error::Theory`] if there is no answer where there should be one.
    pub fn of(&mut self, config: &Config) -> Result<RowTheory, Error> {
        let key = (config.setup.clone(), config.world);
        if let Some((_, known)) = self.0.iter().find(|(of, _)| *of == key) {
            return Ok(*known);
        }
        let said = match expected(&config.setup, config.world) {
            Ok(Expected::Growth(growth) | Expected::MeanSquare(growth)) => RowTheory {
                growth: Some(growth),
                sure: None,
            },
            Ok(Expected::Any(sure)) => RowTheory {
                growth: None,
                sure: Some(sure),
            },
            Err(NotExpected::Stability(error @ StabilityError::Plant(_))) => {
                return Err(Error::Theory(error));
            }
            Err(_) => RowTheory::default(),
        };
        self.0.push((key, said));
        Ok(said)
    }
}

/// An edge between two rows that theory draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Edge {
    /// Small deviations grow on one side of it.
    Grows,
    /// On one side of it no pattern of delays makes them grow.
    Sure,
}

impl Edge {
    /// All there are.
    pub const ALL: [Self; 2] = [Self::Grows, Self::Sure];

    /// The edge between two rows that follow each other, if there is one.
    pub fn between(one: RowTheory, next: RowTheory) -> Option<Self> {
        let grows = |row: RowTheory| row.growth.map(|growth| growth >= 0.0);
        let differ = |one: Option<bool>, next: Option<bool>| {
            one.zip(next).is_some_and(|(one, next)| one != next)
        };
        // A delay that does not change is as sure as it is stable.
        let sure = |row: RowTheory| row.sure.or(grows(row).map(|grows| !grows));
        match () {
            () if differ(grows(one), grows(next)) => Some(Self::Grows),
            () if differ(sure(one), sure(next)) => Some(Self::Sure),
            () => None,
        }
    }

    /// What it means, and where that ends.
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
        }
    }
}

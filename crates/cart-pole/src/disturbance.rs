//! A random force on the cart.

use std::{fmt, str::FromStr};

use ratelab::Chance;

use crate::ParameterError;

/// A random force on the cart, another one in each control step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Disturbance {
    seed: u64,
    /// Standard deviation (N).
    pub(super) newtons: Newtons,
}

/// A standard deviation of forces (N): 0 to [`Newtons::MAX`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Newtons(f64);

impl Newtons {
    /// A hundred times what the motor has.
    const MAX: f64 = 1000.0;
}

impl fmt::Display for Newtons {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl FromStr for Newtons {
    type Err = ParameterError;

    fn from_str(text: &str) -> Result<Self, ParameterError> {
        let newtons: Option<f64> = text.trim().parse().ok();
        newtons
            .filter(|newtons| (0.0..=Self::MAX).contains(newtons))
            .map(Self)
            .ok_or_else(|| ParameterError::Disturbance {
                text: text.to_owned(),
                max: Self::MAX.to_string(),
            })
    }
}

impl Disturbance {
    /// None, until it is set.
    pub(super) fn none(seed: u64) -> Self {
        let newtons = Newtons(0.0);
        Self { seed, newtons }
    }

    /// Returns whether there is none.
    pub(super) fn is_none(&self) -> bool {
        self.newtons.0 == 0.0
    }

    /// Returns the force in control step number `step`, counted from zero (N).
    pub(super) fn force(&self, step: u64) -> f64 {
        if self.is_none() {
            return 0.0;
        }
        let chance = Chance {
            seed: self.seed,
            what: "disturb",
            name: "plant",
        };
        self.newtons.0 * chance.normal(step)
    }
}

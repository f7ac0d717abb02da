//! The values of one quantity in a sweep, as text.

use std::{collections::HashSet, str::FromStr};

use thiserror::Error;

use super::MAX_CELLS;
use crate::runtime::{Depth, Hz};

/// The values of an axis, in the given order: comma-separated single values and ranges,
/// such as `5`, `5,10,25`, `1..30`, `1..30:0.5` or `1..10,25,50`.
///
/// A range includes both ends, if its steps reach the second: `1..30:0.5` ends with 30,
/// `1..30:4` with 29. Without a step it goes up by one.
///
/// ```
/// use ratelab::{experiment::sweep::Axis, runtime::Hz};
///
/// let rates: Axis<Hz> = "1..2:0.25,50".parse()?;
/// let rates: Vec<f64> = rates.values().iter().map(|hz| hz.get()).collect();
/// assert_eq!(rates, [1.0, 1.25, 1.5, 1.75, 2.0, 50.0]);
/// # Ok::<(), ratelab::experiment::sweep::AxisError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Axis<T>(Vec<T>);

impl<T> Axis<T> {
    /// The values, without duplicates.
    pub fn values(&self) -> &[T] {
        &self.0
    }
}

impl<T> From<Axis<T>> for Vec<T> {
    fn from(axis: Axis<T>) -> Self {
        axis.0
    }
}

/// The quantity of an axis, counted in whole units.
pub trait Quantity: Copy {
    /// Units in a step of one.
    const ONE: u64;

    /// Parses a value.
    ///
    /// # Errors
    /// A message with the invalid text and the expected form.
    fn read(text: &str) -> Result<Self, String>;

    /// The value in units.
    fn units(self) -> u64;

    /// Returns the value of `units`, which lie between those of two valid values.
    fn of_units(units: u64) -> Self;
}

impl Quantity for Hz {
    const ONE: u64 = 1_000_000;

    fn read(text: &str) -> Result<Self, String> {
        text.parse().map_err(|error| format!("{error}"))
    }

    fn units(self) -> u64 {
        self.as_micro()
    }

    fn of_units(units: u64) -> Self {
        Self::from_micro(units)
    }
}

impl Quantity for Depth {
    const ONE: u64 = 1;

    fn read(text: &str) -> Result<Self, String> {
        text.parse().map_err(|error| format!("{error}"))
    }

    fn units(self) -> u64 {
        self.get() as u64
    }

    fn of_units(units: u64) -> Self {
        Self::known(units as usize)
    }
}

/// A seed.
impl Quantity for u64 {
    const ONE: u64 = 1;

    fn read(text: &str) -> Result<Self, String> {
        let seed = text.trim().parse();
        seed.map_err(|_| format!("{text:?} is not a seed: expected a whole number from 0"))
    }

    fn units(self) -> u64 {
        self
    }

    fn of_units(units: u64) -> Self {
        units
    }
}

/// Text that is not a valid axis.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum AxisError {
    /// An invalid value.
    #[error("{0}; lists and ranges are written like 5,10,25 and 1..30 and 1..30:2")]
    Value(String),
    /// A descending range.
    #[error("{0:?} goes down: write the smaller end first")]
    Downwards(String),
    /// A range with a step of zero.
    #[error("{0:?} has a step of zero: leave it out for steps of one")]
    NoStep(String),
    /// A repeated value.
    #[error("{0:?} has a value that the list has before it: give each value once")]
    Twice(String),
    /// More values than the maximum number of cells of a sweep.
    #[error("{0:?} has more than {MAX_CELLS} values: make the range smaller or its step larger")]
    TooMany(String),
}

impl<T: Quantity> FromStr for Axis<T> {
    type Err = AxisError;

    fn from_str(text: &str) -> Result<Self, AxisError> {
        let (mut values, mut known) = (Vec::new(), HashSet::new());
        for part in text.split(',').map(str::trim) {
            for units in units_of::<T>(part)? {
                if !known.insert(units) {
                    return Err(AxisError::Twice(part.to_owned()));
                }
                if values.len() == MAX_CELLS {
                    return Err(AxisError::TooMany(text.to_owned()));
                }
                values.push(T::of_units(units));
            }
        }
        Ok(Self(values))
    }
}

/// The values of one list item, in units.
fn units_of<T: Quantity>(part: &str) -> Result<impl Iterator<Item = u64> + use<T>, AxisError> {
    let read = |text| T::read(text).map(T::units).map_err(AxisError::Value);
    let (first, last, step) = match part.split_once("..") {
        None => (read(part)?, read(part)?, T::ONE),
        Some((first, rest)) => match rest.split_once(':') {
            None => (read(first)?, read(rest)?, T::ONE),
            Some((last, step)) => (read(first)?, read(last)?, read(step)?),
        },
    };
    if first > last {
        return Err(AxisError::Downwards(part.to_owned()));
    }
    if step == 0 {
        return Err(AxisError::NoStep(part.to_owned()));
    }
    Ok((0..=(last - first) / step).map(move |k| first + k * step))
}

//! The values of one quantity in a sweep, as text.

use std::{collections::HashSet, fmt, str::FromStr};

use ratelab::{Depth, Hz};
use thiserror::Error;

use super::MAX_CELLS;

/// The values of an axis, in the given order: comma-separated single values and ranges,
/// such as `5`, `5,10,25`, `1..30`, `1..30:0.5` or `1..10,25,50`.
///
/// A range includes both ends, if its steps reach the second: `1..30:0.5` ends with 30,
/// `1..30:4` with 29. Without a step it goes up by one.
///
/// ```
/// use ratelab::Hz;
/// use ratelab_experiment::sweep::Axis;
///
/// let rates: Axis<Hz> = "1..2:0.25,50".parse()?;
/// let rates: Vec<f64> = rates.values().iter().map(|hz| hz.get()).collect();
/// assert_eq!(rates, [1.0, 1.25, 1.5, 1.75, 2.0, 50.0]);
/// # Ok::<(), ratelab_experiment::sweep::AxisError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Axis<T>(Vec<T>);

impl<T> Axis<T> {
    /// Returns the values, without duplicates.
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
    const ONE: i128;

    /// Parses a value, in units.
    ///
    /// # Errors
    /// [`AxisError::Value`] with the invalid text and the expected form.
    fn read(text: &str) -> Result<i128, AxisError>;

    /// Returns the value of so many units, which lie between the units of two values.
    fn from_units(units: i128) -> Self;
}

fn parsed<T: FromStr<Err: fmt::Display>>(text: &str) -> Result<T, AxisError> {
    text.parse::<T>()
        .map_err(|error| AxisError::Value(error.to_string()))
}

impl Quantity for Hz {
    const ONE: i128 = 1_000_000;

    fn read(text: &str) -> Result<i128, AxisError> {
        Ok(parsed::<Self>(text)?.as_micro().into())
    }

    fn from_units(units: i128) -> Self {
        Self::from_micro(units as u64)
    }
}

impl Quantity for Depth {
    const ONE: i128 = 1;

    fn read(text: &str) -> Result<i128, AxisError> {
        Ok(parsed::<Self>(text)?.get() as i128)
    }

    fn from_units(units: i128) -> Self {
        Self::new(units as usize).unwrap_or(Self::MAX)
    }
}

/// A seed.
impl Quantity for u64 {
    const ONE: i128 = 1;

    fn read(text: &str) -> Result<i128, AxisError> {
        let seed: Result<Self, _> = text.trim().parse();
        let expected = || format!("{text:?} is not a seed: expected a whole number from 0");
        seed.map(i128::from)
            .map_err(|_| AxisError::Value(expected()))
    }

    fn from_units(units: i128) -> Self {
        units as u64
    }
}

/// A number as it is written: exact to nine places, so that steps of 0.1 are just
/// that.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Decimal(i64);

impl Quantity for Decimal {
    const ONE: i128 = 1_000_000_000;

    fn read(text: &str) -> Result<i128, AxisError> {
        decimal(text.trim()).map(i128::from).ok_or_else(|| {
            let expected = "expected one such as 12, 0.25 or -3, to 9 places";
            AxisError::Value(format!("{text:?} is not a number: {expected}"))
        })
    }

    fn from_units(units: i128) -> Self {
        Self(units as i64)
    }
}

/// Returns the units of a number.
fn decimal(text: &str) -> Option<i64> {
    let digits = text.strip_prefix('-').unwrap_or(text);
    let (whole, places) = digits.split_once('.').unwrap_or((digits, "0"));
    let written = [whole, places].iter().all(|part| {
        let mut digits = part.bytes();
        !part.is_empty() && digits.all(|digit| digit.is_ascii_digit())
    });
    if !written || places.len() > 9 {
        return None;
    }
    let sign = if digits == text { "" } else { "-" };
    format!("{sign}{whole}{places:0<9}").parse().ok()
}

impl fmt::Display for Decimal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sign = if self.0 < 0 { "-" } else { "" };
        let (whole, places) = (self.0.unsigned_abs() / 1_000_000_000, self.0.unsigned_abs());
        let places = format!("{:09}", places % 1_000_000_000);
        match places.trim_end_matches('0') {
            "" => write!(f, "{sign}{whole}"),
            places => write!(f, "{sign}{whole}.{places}"),
        }
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
    /// A range that never moves, or goes down.
    #[error("{0:?} has no step upwards: leave the step out for steps of one")]
    NoStep(String),
    /// A repeated value.
    #[error("{0:?} has a value that the list has before it: give each value once")]
    Twice(String),
    /// More than one place for the values.
    #[error("{0:?} has more than one place for its values: leave one {{}} in it")]
    Holes(String),
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
                values.push(T::from_units(units));
            }
        }
        Ok(Self(values))
    }
}

/// Returns the values of one part of a list, in units.
fn units_of<T: Quantity>(part: &str) -> Result<impl Iterator<Item = i128> + use<T>, AxisError> {
    let read = T::read;
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
    if step <= 0 {
        return Err(AxisError::NoStep(part.to_owned()));
    }
    Ok((0..=(last - first) / step).map(move |k| first + k * step))
}

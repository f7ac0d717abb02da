//! A knob of a sweep and its values, which are steps or a list of texts.

use std::{collections::HashSet, fmt, str::FromStr, sync::Arc};

use ratelab::{Depth, Hz, Knob, KnobKind};
use ratelab_system::{KnobText, KnobTextError};
use thiserror::Error;

use super::MAX_CELLS;

/// One knob of a sweep, or several with a common name and value.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepAxis {
    /// The name, such as `control-hz`, `rate planner` or `link /obs delay:{}`.
    pub name: String,
    /// Kind of the values.
    pub kind: KnobKind,
    /// The values, in the order of the sweep.
    pub values: Vec<Arc<SweepValue>>,
}

/// One value of a [`SweepAxis`].
#[derive(Clone, Debug, PartialEq)]
pub struct SweepValue {
    /// Name of the axis.
    pub axis: String,
    /// The value as text.
    pub text: String,
    /// The knobs, set to this value.
    pub knobs: Vec<Knob>,
}

/// Where in the name of an axis its values go.
const HOLE: &str = "{}";

impl SweepAxis {
    /// Returns the knob called `name`, an alias or a kind and a target such as
    /// `rate planner`, with the values in `list`; see [`Axis`]. Values go to the end,
    /// or to where `{}` is: `link /obs delay:{}`. Texts have commas in between; one
    /// that is part of a text has a backslash before it.
    ///
    /// # Errors
    /// [`AxisError`] for an unknown knob or an invalid value.
    pub fn parse(knobs: KnobText, name: &str, list: &str) -> Result<Self, AxisError> {
        let kind = knobs.kind(name).map_err(refused)?;
        let texts = match kind {
            KnobKind::Rate => texts::<Hz>(list, |hz| hz.get().to_string())?,
            KnobKind::Depth => texts::<Depth>(list, |depth| depth.to_string())?,
            _ => values(list, |text| is_range(kind, has_hole(name), text))?,
        };
        Self::from_texts(knobs, name, texts)
    }

    /// Returns an axis with `texts` as its values.
    ///
    /// # Errors
    /// [`AxisError`] for an unknown knob or an invalid value.
    pub fn from_texts(
        knobs: KnobText,
        name: &str,
        texts: impl IntoIterator<Item = String>,
    ) -> Result<Self, AxisError> {
        let kind = knobs.kind(name).map_err(refused)?;
        if name.matches(HOLE).count() > 1 {
            return Err(AxisError::Holes(name.to_owned()));
        }
        let mut known = HashSet::new();
        let values = texts.into_iter().map(|text| {
            let knob = if has_hole(name) {
                name.replace(HOLE, &text)
            } else {
                format!("{name} {text}")
            };
            let knobs = knobs.parse(&knob).map_err(refused)?;
            if !known.insert(knobs.iter().map(Knob::to_string).collect::<Vec<_>>()) {
                return Err(AxisError::Twice(text));
            }
            let axis = name.to_owned();
            Ok(Arc::new(SweepValue { axis, text, knobs }))
        });
        Ok(Self {
            name: name.to_owned(),
            kind,
            values: values.collect::<Result<_, AxisError>>()?,
        })
    }

    /// Returns an axis with one value that changes nothing, for a sweep over seeds alone.
    pub fn as_given() -> Self {
        let name = "setting".to_owned();
        let value = SweepValue {
            axis: name.clone(),
            text: "as given".to_owned(),
            knobs: Vec::new(),
        };
        Self {
            name,
            // Its value is a name without a unit.
            kind: KnobKind::Read,
            values: vec![Arc::new(value)],
        }
    }

    /// Returns whether its values go into the middle of its knob.
    pub fn has_hole(&self) -> bool {
        has_hole(&self.name)
    }
}

fn has_hole(name: &str) -> bool {
    name.contains(HOLE)
}

/// Returns whether `text` is a range of numbers. What ticks take can be `60..110`, which is one
/// value: with a step it is a range.
fn is_range(kind: KnobKind, hole: bool, text: &str) -> bool {
    let begins = text.starts_with(|c: char| c.is_ascii_digit() || "-.".contains(c));
    let whole = match kind {
        KnobKind::Send => false,
        kind if kind.is_drawn() => text.contains(':'),
        _ => true,
    };
    begins && text.contains("..") && (hole || whole)
}

fn texts<T: Quantity>(list: &str, text: fn(&T) -> String) -> Result<Vec<String>, AxisError>
where
    Axis<T>: FromStr<Err = AxisError>,
{
    let axis: Axis<T> = list.parse()?;
    Ok(axis.values().iter().map(text).collect())
}

/// Returns the texts in `list`, those that are ranges one by one.
fn values(list: &str, is_range: impl Fn(&str) -> bool) -> Result<Vec<String>, AxisError> {
    let mut values = Vec::new();
    for text in messages(list) {
        if is_range(&text) {
            values.extend(texts::<Decimal>(&text, Decimal::to_string)?)
        } else {
            values.push(text)
        }
        if values.len() > MAX_CELLS {
            return Err(AxisError::TooMany(list.to_owned()));
        }
    }
    Ok(values)
}

fn messages(list: &str) -> Vec<String> {
    let mut messages = vec![String::new()];
    for piece in list.split_inclusive(',') {
        let mut message = messages.pop().unwrap_or_default();
        match (piece.strip_suffix("\\,"), piece.strip_suffix(',')) {
            (Some(start), _) => messages.push(message + start + ","),
            (None, Some(end)) => messages.extend([message + end, String::new()]),
            (None, None) => {
                message.push_str(piece);
                messages.push(message);
            }
        }
    }
    messages
        .iter()
        .map(|message| message.trim().to_owned())
        .collect()
}

fn refused(error: KnobTextError) -> AxisError {
    AxisError::Value(error.to_string())
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_as_they_are_written_to_nine_places() {
        for (text, units, shown) in [
            ("12", Some(12_000_000_000), "12"),
            ("0.25", Some(250_000_000), "0.25"),
            ("-3.10", Some(-3_100_000_000), "-3.1"),
            ("-0.5", Some(-500_000_000), "-0.5"),
            ("0.000000001", Some(1), "0.000000001"),
            ("0.0000000001", None, ""),
            ("1.", None, ""),
            (".5", None, ""),
            ("1e3", None, ""),
            ("--1", None, ""),
            ("9223372037", None, ""),
        ] {
            assert_eq!(decimal(text), units, "{text}");
            let text = units.map(|units| Decimal(units).to_string());
            assert_eq!(text.unwrap_or_default(), shown);
        }
    }

    #[test]
    fn a_range_has_its_last_step_that_does_not_pass_its_end() {
        for (part, expected) in [
            ("5", &[5][..]),
            ("1..4", &[1, 2, 3, 4]),
            ("1..8:3", &[1, 4, 7]),
            ("7..7:9", &[7]),
        ] {
            let found: Vec<i128> = units_of::<u64>(part).expect(part).collect();
            assert_eq!(found, expected, "{part}");
        }
    }

    #[test]
    fn commas_part_texts_but_for_those_after_a_backslash() {
        for (list, expected) in [
            ("none", &["none"][..]),
            ("none, delay:3", &["none", "delay:3"]),
            (r"delay:3\,loss:0.1,none", &["delay:3,loss:0.1", "none"]),
            ("a,,b", &["a", "", "b"]),
            ("a,", &["a", ""]),
        ] {
            assert_eq!(messages(list), expected, "{list}");
        }
    }

    #[test]
    fn a_drawn_duration_is_one_value_unless_it_has_a_step() {
        for (kind, hole, text, expected) in [
            (KnobKind::Takes, false, "60..110", false),
            (KnobKind::Takes, false, "6..8:1", true),
            (KnobKind::Link, true, "1..3", true),
            (KnobKind::Hang, false, "6..8", true),
            (KnobKind::Offset, false, "6..8", true),
            (KnobKind::Send, false, "1..8", false),
            (KnobKind::Offset, false, "6", false),
            (KnobKind::Offset, false, "x..y", false),
        ] {
            assert_eq!(is_range(kind, hole, text), expected, "{kind:?} {text}");
        }
    }
}

//! A knob of a sweep and its values.

use std::{collections::HashSet, str::FromStr, sync::Arc};

use ratelab::{Depth, Hz, Knob, KnobKind};

use super::{
    MAX_CELLS,
    axis::{Axis, AxisError, Decimal, Quantity},
};
use ratelab_system::{KnobText, KnobTextError};

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

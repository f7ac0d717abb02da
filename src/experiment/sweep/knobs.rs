//! A knob of a sweep and its values.

use std::{str::FromStr, sync::Arc};

use super::axis::{Axis, AxisError, Quantity};
use crate::{
    runtime::{Depth, Hz, Knob, KnobKind},
    system::{KnobText, KnobTextError},
};

/// One knob of a sweep, or several with a common name and value.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepAxis {
    /// Name, such as `control-hz` or `rate planner`.
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

impl SweepAxis {
    /// Creates the axis called `name`, an alias or a kind and a target such as `rate
    /// planner`, with the values in `list`; see [`Axis`]. Messages are separated by
    /// commas; a comma within a message is escaped with a backslash.
    ///
    /// # Errors
    /// [`AxisError`] for an unknown knob or an invalid value.
    pub fn parse(knobs: KnobText, name: &str, list: &str) -> Result<Self, AxisError> {
        let kind = knobs.kind(name).map_err(refused)?;
        let texts = match kind {
            KnobKind::Rate => texts::<Hz>(list, |hz| hz.get().to_string())?,
            KnobKind::Depth => texts::<Depth>(list, |depth| depth.to_string())?,
            _ => messages(list),
        };
        Self::of(knobs, name, texts)
    }

    /// The same with `texts` as its values.
    ///
    /// # Errors
    /// [`AxisError`] for an unknown knob or an invalid value.
    pub fn of(
        knobs: KnobText,
        name: &str,
        texts: impl IntoIterator<Item = String>,
    ) -> Result<Self, AxisError> {
        let kind = knobs.kind(name).map_err(refused)?;
        let values = texts.into_iter().map(|text| {
            let knobs = knobs.parse(&format!("{name} {text}")).map_err(refused)?;
            let axis = name.to_owned();
            Ok(Arc::new(SweepValue { axis, text, knobs }))
        });
        Ok(Self {
            name: name.to_owned(),
            kind,
            values: values.collect::<Result<_, AxisError>>()?,
        })
    }
}

fn texts<T: Quantity>(list: &str, text: fn(&T) -> String) -> Result<Vec<String>, AxisError>
where
    Axis<T>: FromStr<Err = AxisError>,
{
    let axis: Axis<T> = list.parse()?;
    Ok(axis.values().iter().map(text).collect())
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
    let messages = messages.iter().map(|message| message.trim().to_owned());
    messages.collect()
}

fn refused(error: KnobTextError) -> AxisError {
    AxisError::Value(error.to_string())
}

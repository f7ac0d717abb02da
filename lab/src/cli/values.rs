//! Values of arguments, and what is wrong with them.

use std::{ops::RangeInclusive, str::FromStr, time::Duration};

use ratatui::layout::Size;
use ratelab::{Knob, KnobKind, Speed, Time};
use thiserror::Error;

/// Longest run accepted: a year.
const LONGEST_S: f64 = 365.0 * 24.0 * 3600.0;

pub fn seed(text: &str) -> Result<u64, ValueError> {
    text.trim().parse().map_err(|_| ValueError::Seed)
}

/// Returns a size of a screen, such as `120x35`.
pub fn size(text: &str) -> Result<Size, ValueError> {
    let size = text.split_once('x').and_then(|(width, height)| {
        Some(Size::new(
            width.trim().parse().ok()?,
            height.trim().parse().ok()?,
        ))
    });
    let fits = |size: &Size| (40..=400).contains(&size.width) && (12..=200).contains(&size.height);
    size.filter(fits).ok_or(ValueError::Size)
}

/// Returns a run time in seconds.
pub fn duration(text: &str) -> Result<Time, ValueError> {
    number(text, "seconds", 1e-3, LONGEST_S)
        .and_then(|seconds| Time::from_secs_f64(seconds).map_err(ValueError::refused))
}

/// Returns a wait in seconds.
pub fn wait(text: &str) -> Result<Duration, ValueError> {
    number(text, "seconds", 0.0, LONGEST_S).map(Duration::from_secs_f64)
}

/// Returns a time in milliseconds.
pub fn milliseconds(text: &str) -> Result<Duration, ValueError> {
    let ms = number(text, "milliseconds", 0.0, 60_000.0)?;
    Ok(Duration::from_secs_f64(ms / 1e3))
}

/// Returns a share of runs.
pub fn share(text: &str) -> Result<f64, ValueError> {
    number(text, "(a share)", 0.01, 1.0)
}

/// Returns what one tick of a node takes.
pub fn hang(text: &str) -> Result<(String, Duration), ValueError> {
    let (node, ms) = split_node(text, "MS")?;
    Ok((node.to_owned(), milliseconds(ms)?))
}

pub fn step_ms(text: &str) -> Result<u64, ValueError> {
    text.trim().parse().map_err(|_| ValueError::Step)
}

/// Returns the duration of a node's ticks.
pub fn takes(text: &str) -> Result<Knob, ValueError> {
    node_knob(KnobKind::Takes, text)
}

/// Offset of a node's due times.
pub fn offset(text: &str) -> Result<Knob, ValueError> {
    node_knob(KnobKind::Offset, text)
}

fn node_knob(kind: KnobKind, text: &str) -> Result<Knob, ValueError> {
    let (node, value) = split_node(text, kind.value_name())?;
    kind.set(node, value).map_err(ValueError::refused)
}

/// Returns a node and what is set of it, whose form is called `value_name`.
fn split_node<'t>(text: &'t str, value_name: &str) -> Result<(&'t str, &'t str), ValueError> {
    let parts = text
        .split_once('=')
        .map(|(node, value)| (node.trim(), value));
    parts
        .filter(|(node, _)| !node.is_empty())
        .ok_or_else(|| ValueError::NodeValue(value_name.to_owned()))
}

pub fn speed(text: &str) -> Result<Speed, ValueError> {
    if text == "max" {
        return Ok(Speed::Unlimited);
    }
    let factor = text.parse().map_err(|_| ValueError::Speed)?;
    Speed::times(factor).map_err(|_| ValueError::Speed)
}

/// Returns a speed, for what has to have one.
pub fn pace(text: &str) -> Result<f64, ValueError> {
    match speed(text) {
        Ok(Speed::Times(pace)) => Ok(pace.get()),
        _ => Err(ValueError::Pace),
    }
}

/// Returns a number of settings of the phases.
pub fn phases(text: &str) -> Result<usize, ValueError> {
    within(text, "settings of the phases", 1..=1_000)
}

/// Returns a number of messages that a hunt may lose.
pub fn messages(text: &str) -> Result<usize, ValueError> {
    within(text, "messages", 0..=1_000_000)
}

pub fn fps(text: &str) -> Result<u32, ValueError> {
    within(text, "frames per second", 1..=120)
}

/// Parses a number in `range`; `unit` is its unit in the error message.
pub fn within<T>(text: &str, unit: &str, range: RangeInclusive<T>) -> Result<T, ValueError>
where
    T: FromStr + PartialOrd + std::fmt::Display,
{
    let number = text.trim().parse().ok();
    number
        .filter(|number| range.contains(number))
        .ok_or_else(|| ValueError::Range {
            min: range.start().to_string(),
            max: range.end().to_string(),
            unit: unit.to_owned(),
        })
}

fn number(text: &str, unit: &str, min: f64, max: f64) -> Result<f64, ValueError> {
    within(text, unit, min..=max)
}

/// Why a value of an option is refused: what was expected.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ValueError {
    /// A seed.
    #[error("expected a whole number from 0 to {}", u64::MAX)]
    Seed,
    /// The size of a screen.
    #[error("expected columns x rows, 40x12 to 400x200, such as 120x35")]
    Size,
    /// A number in a range.
    #[error("expected {min} to {max} {unit}")]
    Range {
        /// The least number.
        min: String,
        /// The greatest number.
        max: String,
        /// The unit.
        unit: String,
    },
    /// The step of the physics.
    #[error("expected 1, 2, 5 or 10 milliseconds")]
    Step,
    /// A node with a value, which has this form.
    #[error("expected NODE={0}")]
    NodeValue(String),
    /// The speed of virtual time.
    #[error("expected max, or 0.1 to 100 times wall time")]
    Speed,
    /// A speed that is a number.
    #[error("expected 0.1 to 100 times wall time")]
    Pace,
    /// The number of an exercise.
    #[error("expected one of {0}")]
    Exercise(String),
    /// The number of an exercise, or the word `check`.
    #[error("expected one of {0}, or check")]
    ExerciseOrCheck(String),
    /// A knob that the library refuses, with its reason.
    #[error("{0}")]
    Refused(String),
}

impl ValueError {
    /// Creates the error for a refusal by the library.
    pub fn refused(reason: impl ToString) -> Self {
        Self::Refused(reason.to_string())
    }
}

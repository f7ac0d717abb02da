//! Parses the values of options.

use std::{ops::RangeInclusive, str::FromStr, time::Duration};

use ratatui::layout::Size;
use ratelab::{Knob, KnobKind, Speed, Time};

/// Longest run accepted: a year.
const LONGEST_S: f64 = 365.0 * 24.0 * 3600.0;

pub fn seed(text: &str) -> Result<u64, String> {
    let expected = || format!("expected a whole number from 0 to {}", u64::MAX);
    text.trim().parse().map_err(|_| expected())
}

/// A size of a screen, such as `120x35`.
pub fn size(text: &str) -> Result<Size, String> {
    let size = text.split_once('x').and_then(|(width, height)| {
        Some(Size::new(
            width.trim().parse().ok()?,
            height.trim().parse().ok()?,
        ))
    });
    let fits = |size: &Size| (40..=400).contains(&size.width) && (12..=200).contains(&size.height);
    size.filter(fits)
        .ok_or_else(|| "expected columns x rows, 40x12 to 400x200, such as 120x35".to_owned())
}

/// A run time in seconds.
pub fn duration(text: &str) -> Result<Time, String> {
    number(text, "seconds", 1e-3, LONGEST_S)
        .and_then(|seconds| Time::from_secs_f64(seconds).map_err(|error| error.to_string()))
}

/// A wait in seconds.
pub fn wait(text: &str) -> Result<Duration, String> {
    number(text, "seconds", 0.0, LONGEST_S).map(Duration::from_secs_f64)
}

/// A time in milliseconds.
pub fn milliseconds(text: &str) -> Result<Duration, String> {
    let ms = number(text, "milliseconds", 0.0, 60_000.0)?;
    Ok(Duration::from_secs_f64(ms / 1e3))
}

/// What one tick of a node takes.
pub fn hang(text: &str) -> Result<(String, Duration), String> {
    let (node, ms) = of_node(text, "MS")?;
    Ok((node.to_owned(), milliseconds(ms)?))
}

pub fn step_ms(text: &str) -> Result<u64, String> {
    let step = text.trim().parse().ok();
    step.ok_or_else(|| "expected 1, 2, 5 or 10 milliseconds".to_owned())
}

/// Duration of a node's ticks.
pub fn takes(text: &str) -> Result<Knob, String> {
    node_knob(KnobKind::Takes, text)
}

/// Offset of a node's due times.
pub fn offset(text: &str) -> Result<Knob, String> {
    node_knob(KnobKind::Offset, text)
}

fn node_knob(kind: KnobKind, text: &str) -> Result<Knob, String> {
    let (node, value) = of_node(text, kind.value_name())?;
    kind.set(node, value).map_err(|error| error.to_string())
}

/// A node and what is set of it, whose form is called `value_name`.
fn of_node<'t>(text: &'t str, value_name: &str) -> Result<(&'t str, &'t str), String> {
    let parts = text
        .split_once('=')
        .map(|(node, value)| (node.trim(), value));
    let named = parts.filter(|(node, _)| !node.is_empty());
    named.ok_or_else(|| format!("expected NODE={value_name}"))
}

pub fn speed(text: &str) -> Result<Speed, String> {
    if text == "max" {
        return Ok(Speed::Unlimited);
    }
    let expected = "expected max, or 0.1 to 100 times wall time";
    let factor = text.parse().map_err(|_| expected.to_owned())?;
    Speed::times(factor).map_err(|_| expected.to_owned())
}

/// A speed, for what has to have one.
pub fn pace(text: &str) -> Result<f64, String> {
    match speed(text) {
        Ok(Speed::Times(pace)) => Ok(pace.get()),
        _ => Err("expected 0.1 to 100 times wall time".to_owned()),
    }
}

/// A number of settings of the phases.
pub fn phases(text: &str) -> Result<usize, String> {
    within(text, "settings of the phases", 1..=1_000)
}

pub fn fps(text: &str) -> Result<u32, String> {
    within(text, "frames per second", 1..=120)
}

/// Parses a number in `range`; `unit` is its unit in the error message.
pub fn within<T>(text: &str, unit: &str, range: RangeInclusive<T>) -> Result<T, String>
where
    T: FromStr + PartialOrd + std::fmt::Display,
{
    let number = text.trim().parse().ok();
    number
        .filter(|number| range.contains(number))
        .ok_or_else(|| format!("expected {} to {} {unit}", range.start(), range.end()))
}

fn number(text: &str, unit: &str, least: f64, most: f64) -> Result<f64, String> {
    within(text, unit, least..=most)
}

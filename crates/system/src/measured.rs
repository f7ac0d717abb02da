//! Measured durations that knobs draw from, and text files of them: a column of milliseconds.

use std::{path::Path, time::Duration};

use ratelab::{Draw, Knob, Measurements, millis};

use crate::file;

/// Maximum size of a file (bytes): about a million durations.
const LARGEST: u64 = 1 << 23;

/// This knob with the durations that it draws from, if they are not loaded yet: those that
/// `read` returns.
///
/// # Errors
/// That of `read`, or one if there are no durations, or other ones than when they were first read.
pub fn loaded(
    knob: Knob,
    read: impl FnOnce(&Knob, &Measurements) -> Result<Vec<Duration>, String>,
) -> Result<Knob, String> {
    let Some(missing) = knob.draw().and_then(Draw::missing) else {
        return Ok(knob);
    };
    let durations = read(&knob, missing)?;
    let measured = missing
        .with_durations(durations)
        .map_err(|error| error.to_string())?;
    Ok(knob.with_draw(Draw::Measured(measured)))
}

/// Reads the durations in the file at `path`, one a line in milliseconds. The first line may name
/// the column; empty lines and comments behind `#` are ignored.
///
/// # Errors
/// The file, its line, the value there and what was expected.
pub fn read_column(path: &Path) -> Result<Vec<Duration>, String> {
    let text = file::read_text(path, LARGEST).map_err(|why| why.to_string());
    text.and_then(|text| parse(&text))
        .map_err(|why| format!("{}: {why}", path.display()))
}

fn parse(text: &str) -> Result<Vec<Duration>, String> {
    // Spreadsheets write a byte order mark.
    let mut values = text
        .trim_start_matches('\u{feff}')
        .lines()
        .zip(1..)
        .filter_map(|(line, number)| {
            let value = line.split('#').next()?.trim();
            (!value.is_empty()).then_some((number, value))
        })
        .peekable();
    values.next_if(|(_, value)| is_name(value));
    let durations = values.map(|(number, value)| {
        millis::parse(value).map_err(|_| {
            format!(
                "line {number}: {value:?} is not a duration: expected milliseconds, one number a line \
                 such as 12.5"
            )
        })
    });
    let durations: Vec<Duration> = durations.collect::<Result<_, _>>()?;
    if durations.is_empty() {
        Err("no number is in it: expected milliseconds, one number a line".to_owned())
    } else {
        Ok(durations)
    }
}

/// Returns whether `value` names a column, and one only.
fn is_name(value: &str) -> bool {
    let named = value.starts_with(|first: char| first == '"' || first.is_alphabetic());
    named && value.parse::<f64>().is_err() && !value.contains([',', ';', '\t'])
}

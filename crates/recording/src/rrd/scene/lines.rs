//! Lines over time, and colours that nearly everybody can distinguish.

use ratelab::Time;
use rerun::{
    Color, EntityPath, RecordingStream, Scalars, SeriesLines, components::InterpolationMode,
};

use crate::rrd::timeline::{BatchStream, Written};

/// How a line looks.
pub struct Line {
    /// Its name and unit.
    pub name: String,
    /// Its colour.
    pub colour: Color,
    /// Its width (points).
    pub width: f32,
}

impl Line {
    /// Creates a line of `width` points.
    pub fn new(name: impl Into<String>, colour: Color, width: f32) -> Self {
        Self {
            name: name.into(),
            colour,
            width,
        }
    }
}

/// Logs how the lines of `entity` look.
pub fn begin(rec: &RecordingStream, entity: impl Into<EntityPath>, lines: &[Line]) -> Written {
    let style = SeriesLines::new()
        .with_names(lines.iter().map(|line| line.name.as_str()))
        .with_colors(lines.iter().map(|line| line.colour))
        .with_widths(lines.iter().map(|line| line.width));
    rec.log_static(entity, &style)
}

/// Logs `count` values per row, row after row.
pub fn send(
    stream: &BatchStream,
    entity: impl Into<EntityPath>,
    times: &[Time],
    values: impl IntoIterator<Item = f64>,
    count: usize,
) -> Written {
    let counts = std::iter::repeat_n(count, times.len());
    stream.send(entity, times, Scalars::new(values).columns(counts)?)
}

/// For a view: values that hold from one row to the next.
pub fn stepped() -> SeriesLines {
    SeriesLines::update_fields().with_interpolation_mode(InterpolationMode::StepAfter)
}

/// The plant, and good news.
pub const BLUE: Color = rgb(0x56, 0xb4, 0xe9);

/// Actions on it, and alarms.
pub const ORANGE: Color = rgb(0xe6, 0x9f, 0x00);

/// Behind everything in space.
pub const NIGHT: Color = rgb(0x14, 0x17, 0x1c);

/// Neutral.
pub const WHITE: Color = rgb(0xe0, 0xe0, 0xe0);

/// Limits and references.
pub const GREY: Color = rgb(0x99, 0x99, 0x99);

const YELLOW: Color = rgb(0xf0, 0xe4, 0x42);
/// Ages.
pub const PINK: Color = rgb(0xcc, 0x79, 0xa7);

/// A colour for each of several series, and what it is called; they repeat
/// after the fifth.
const SERIES: [(Color, &str); 5] = [
    (BLUE, "blue"),
    (ORANGE, "orange"),
    (GREY, "grey"),
    (YELLOW, "yellow"),
    (PINK, "pink"),
];

/// Returns a colour for each of `count` series.
pub fn series(count: usize) -> impl Iterator<Item = Color> {
    let colours = SERIES.into_iter().cycle().take(count);
    colours.map(|(colour, _)| colour)
}

/// Returns a line width for each of `count` series (points): the later ones are drawn on top, so
/// that the lines below still show.
pub fn widths(count: usize) -> impl Iterator<Item = f32> {
    (1..=count).rev().map(|rank| 0.5 + rank as f32)
}

/// Says which of the series called `names` has which colour. A title does not
/// cover data as a legend does.
pub fn key<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let colours = SERIES.iter().cycle();
    let words: Vec<String> = names
        .into_iter()
        .zip(colours)
        .map(|(name, (_, colour))| format!("{name} {colour}"))
        .collect();
    words.join(", ")
}

const fn rgb(red: u8, green: u8, blue: u8) -> Color {
    Color(rerun::Rgba32::from_rgb(red, green, blue))
}

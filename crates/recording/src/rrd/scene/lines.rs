//! Several lines over time on one entity.

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

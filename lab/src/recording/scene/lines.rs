//! Several lines over time on one entity.

use rerun::{
    Color, EntityPath, RecordingStream, RecordingStreamResult, Scalars, SeriesLines,
    components::InterpolationMode,
};

use crate::recording::timeline::Stamps;

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
    /// A line of `width` points.
    pub fn new(name: impl Into<String>, colour: Color, width: f32) -> Self {
        let name = name.into();
        Self {
            name,
            colour,
            width,
        }
    }
}

/// Logs how the lines of `entity` look.
pub fn begin(
    rec: &RecordingStream,
    entity: impl Into<EntityPath>,
    lines: &[Line],
) -> RecordingStreamResult<()> {
    let style = SeriesLines::new()
        .with_names(lines.iter().map(|line| line.name.as_str()))
        .with_colors(lines.iter().map(|line| line.colour))
        .with_widths(lines.iter().map(|line| line.width));
    rec.log_static(entity, &style)
}

/// Logs `count` values per row, row after row.
pub fn send(
    rec: &RecordingStream,
    entity: impl Into<EntityPath>,
    stamps: &Stamps,
    values: impl IntoIterator<Item = f64>,
    count: usize,
) -> RecordingStreamResult<()> {
    if stamps.is_empty() {
        return Ok(());
    }
    let counts = std::iter::repeat_n(count, stamps.len());
    let columns = Scalars::new(values).columns(counts)?;
    rec.send_columns(entity, stamps.columns(), columns)
}

/// For a view: values that hold from one row to the next.
pub fn stepped() -> SeriesLines {
    SeriesLines::update_fields().with_interpolation_mode(InterpolationMode::StepAfter)
}

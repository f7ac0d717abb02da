//! A line per group, a cell per control rate.

use super::{Picture, growth_text, paint, shade};
use crate::{
    dashboard::view::theme::Theme,
    sweep::{
        shade::Shade,
        survey::{Row, Survey},
    },
};

/// Columns of a cell: a glyph and a digit.
const CELL: usize = 2;

/// Blanks between the name of a group and its cells.
const GAP: usize = 2;

/// What a cell says.
pub fn key(theme: &Theme) -> String {
    format!("{}; the digit is the share in tenths", Shade::key(theme))
}

/// The map, in several pieces if it is too wide for one.
pub fn lines(survey: &Survey, picture: &Picture) -> Vec<String> {
    let cell = |row: &Row| paint(&cell(row, &picture.theme), shade(row), &picture.theme);
    pieces(survey, picture, CELL, cell)
}

/// What linear theory says of each cell, beside the map and not in it.
pub fn growth(survey: &Survey, picture: &Picture) -> Vec<String> {
    let texts = survey.rows().iter().map(|row| growth_text(row.growth));
    let widest = texts.map(|text| text.len()).max().unwrap_or(1);
    let cell = |row: &Row| format!("{:>widest$} ", growth_text(row.growth));
    pieces(survey, picture, widest + 1, cell)
}

/// A glyph, and where there are some and not all of them, tenths.
fn cell(row: &Row, theme: &Theme) -> String {
    let shade = shade(row);
    let glyph = shade.glyph(theme);
    match (shade, row.share()) {
        (Shade::Unknown | Shade::None | Shade::All, _) | (_, None) => glyph.repeat(CELL),
        (_, Some(share)) => format!("{glyph}{}", (share * 10.0) as u64),
    }
}

fn pieces(
    survey: &Survey,
    picture: &Picture,
    cell: usize,
    text: impl Fn(&Row) -> String,
) -> Vec<String> {
    let names: Vec<String> = survey.groups().map(|rows| name(survey, rows)).collect();
    let wide = names.iter().map(String::len).max().unwrap_or(0);
    let wide = wide.max("control Hz".len());
    let fit = (picture.width.saturating_sub(wide + GAP) / cell).max(1);
    let rates = survey.sweep.control_hz.len();
    let mut lines = Vec::new();
    for first in (0..rates).step_by(fit) {
        let piece = first..rates.min(first + fit);
        if first > 0 {
            lines.push(String::new());
        }
        let labels = survey.sweep.control_hz[piece.clone()].iter();
        let labels: Vec<String> = labels.map(|hz| hz.get().to_string()).collect();
        lines.extend(axis(&labels, wide, cell));
        for (name, rows) in names.iter().zip(survey.groups()) {
            let cells: String = rows[piece.clone()].iter().map(&text).collect();
            lines.push(
                format!("{name:<wide$}{:GAP$}{cells}", "")
                    .trim_end()
                    .to_owned(),
            );
        }
    }
    lines
}

/// The control rates over their cells, downwards where they are too long.
fn axis(labels: &[String], wide: usize, cell: usize) -> Vec<String> {
    let labels = aligned(labels);
    let longest = labels.iter().map(String::len).max().unwrap_or(0);
    let name = |line: usize| if line == 0 { "control Hz" } else { "" };
    let line = |number: usize, cells: String| {
        let line = format!("{:<wide$}{:GAP$}{cells}", name(number), "");
        line.trim_end().to_owned()
    };
    if longest < cell {
        let cells = labels
            .iter()
            .map(|label| format!("{:<cell$}", label.trim()));
        return vec![line(0, cells.collect())];
    }
    let lines = (0..longest).map(|number| {
        let letters = labels.iter().map(|label| {
            let letter = label.chars().nth(number).unwrap_or(' ');
            format!("{letter:<cell$}")
        });
        line(number, letters.collect())
    });
    lines.collect()
}

/// The same with their points, or where those would be, in one place.
fn aligned(labels: &[String]) -> Vec<String> {
    let whole = |label: &str| label.find('.').unwrap_or(label.len());
    let most = labels.iter().map(|label| whole(label)).max().unwrap_or(0);
    let pad = |label: &String| " ".repeat(most - whole(label)) + label;
    labels.iter().map(pad).collect()
}

/// A group by what sets it apart from the others.
fn name(survey: &Survey, rows: &[Row]) -> String {
    let sweep = &survey.sweep;
    let Some(cell) = rows.first().map(|row| &row.cell) else {
        return String::new();
    };
    let parts = [
        (sweep.policies.len(), cell.policy.name().to_owned()),
        (
            sweep.sensor_hz.len(),
            format!("sensor {}", cell.sensor_hz.get()),
        ),
        (
            sweep.queue_depths.len(),
            format!("depth {}", cell.queue_depth),
        ),
    ];
    let parts = parts.into_iter().filter(|(values, _)| *values > 1);
    parts.map(|(_, part)| part).collect::<Vec<_>>().join(" ")
}

//! A map with a line per group and a cell per value of the fastest knob.

use std::iter;

use ratelab_screen::{SurvivalLevel, Theme};

use super::{MapStyle, edge_marks, level};
use crate::sweep::summary::{Figure, RowSummary, SweepSummary};

/// Columns of a cell: a glyph and a digit.
const CELL: usize = 2;

/// Blanks between the name of a group and its cells.
const GAP: usize = 2;

/// Returns the legend of the cells.
pub fn key(summary: &SweepSummary, theme: &Theme) -> String {
    let key = SurvivalLevel::key(&summary.good, theme);
    format!("{key}; the digit is the share in tenths")
}

/// Returns the map, in several pieces if it is too wide for one.
pub fn lines(summary: &SweepSummary, style: &MapStyle) -> Vec<String> {
    let theme = &style.theme;
    let cell = |row: &RowSummary| level(row).paint(&cell(row, theme), theme);
    if !summary.theory {
        return pieces(summary, style, CELL, |rows, place| cell(&rows[place]));
    }
    // A column more, for the edges, and a line where there are some between groups.
    pieces(summary, style, CELL + 1, |rows, place| {
        let next = rows.get(place + 1);
        let edge = next.and_then(|next| rows[place].edge(next));
        let [_, upright] = edge.map_or([" "; 2], |edge| edge_marks(edge, theme));
        cell(&rows[place]) + upright
    })
}

/// Returns a figure of linear theory for each cell, beside the map.
pub fn theory(summary: &SweepSummary, style: &MapStyle, figure: &Figure) -> Vec<String> {
    let widest = summary
        .rows()
        .iter()
        .map(|row| figure.text(row))
        .map(|text| text.len())
        .max()
        .unwrap_or(1);
    pieces(summary, style, widest + 1, |rows, place| {
        format!("{:>widest$} ", figure.text(&rows[place]))
    })
}

/// Returns a glyph, followed by tenths if some but not all runs were successful.
fn cell(row: &RowSummary, theme: &Theme) -> String {
    let level = level(row);
    let glyph = level.glyph(theme);
    match (level, row.survival.share()) {
        (SurvivalLevel::Unknown | SurvivalLevel::None | SurvivalLevel::All, _) | (_, None) => {
            glyph.repeat(CELL)
        }
        (_, Some(share)) => format!("{glyph}{}", (share * 10.0) as u64),
    }
}

fn pieces(
    summary: &SweepSummary,
    style: &MapStyle,
    cell: usize,
    text: impl Fn(&[RowSummary], usize) -> String,
) -> Vec<String> {
    let grid = summary.grid();
    let wide = grid.wide();
    let line = |name: &str, cells: &str| {
        let line = format!("{name:<wide$}{:GAP$}{cells}", "");
        line.trim_end().to_owned()
    };
    let fit = (style.width.saturating_sub(wide + GAP) / cell).max(1);
    let count = grid.values.len();
    let mut lines = Vec::new();
    for first in (0..count).step_by(fit) {
        let piece = first..count.min(first + fit);
        if first > 0 {
            lines.push(String::new());
        }
        let axis = [&*grid.heading]
            .into_iter()
            .chain(iter::repeat(""))
            .zip(axis(&grid.values[piece.clone()], cell));
        lines.extend(axis.map(|(name, cells)| line(name, &cells)));
        for (place, (name, rows)) in grid.groups.iter().enumerate() {
            let cells: String = piece.clone().map(|place| text(rows, place)).collect();
            lines.push(line(name, &cells));
            let next = grid.groups.get(place + 1).filter(|_| summary.is_plane());
            let edges = next
                .map(|(_, next)| {
                    let (rows, next) = (&rows[piece.clone()], &next[piece.clone()]);
                    edges(rows, next, cell, &style.theme)
                })
                .filter(|edges| !edges.trim().is_empty());
            lines.extend(edges.map(|edges| line("", &edges)));
        }
    }
    lines
}

/// Returns the edges that theory draws between two groups, each as wide as a cell.
fn edges(rows: &[RowSummary], next: &[RowSummary], cell: usize, theme: &Theme) -> String {
    let marks = rows.iter().zip(next).map(|(row, next)| {
        let edge = row.edge(next);
        let [flat, _] = edge.map_or([" "; 2], |edge| edge_marks(edge, theme));
        flat.repeat(cell - 1) + " "
    });
    marks.collect()
}

/// Returns the values above their cells, written vertically if they are too long.
fn axis(labels: &[&str], cell: usize) -> Vec<String> {
    let labels = aligned(labels);
    let longest = labels.iter().map(String::len).max().unwrap_or(0);
    if longest < cell {
        let cells = labels
            .iter()
            .map(|label| format!("{:<cell$}", label.trim()));
        return vec![cells.collect()];
    }
    let line = |number: usize| {
        labels
            .iter()
            .map(|label| label.chars().nth(number).unwrap_or(' '))
            .map(|letter| format!("{letter:<cell$}"))
            .collect()
    };
    (0..longest).map(line).collect()
}

/// Returns `labels`, aligned at their decimal points.
fn aligned(labels: &[&str]) -> Vec<String> {
    let whole = |label: &str| label.find('.').unwrap_or(label.len());
    let most = labels.iter().map(|label| whole(label)).max().unwrap_or(0);
    let pad = |label: &&str| " ".repeat(most - whole(label)) + label;
    labels.iter().map(pad).collect()
}

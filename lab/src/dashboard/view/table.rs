//! Tables with fixed columns for changing figures.

use ratatui::{
    buffer::Buffer,
    layout::{Constraint, Rect},
    style::Style,
    text::{Line, Span},
    widgets::{Row, Table, Widget},
};

use super::pane::{self, clamp, clip, plain, put, row};
use crate::theme::Theme;

/// Blanks between columns.
const GAP: usize = 2;

/// A column of figures.
#[derive(Clone, Copy, Debug)]
pub struct TableColumn {
    /// Its title, with the unit.
    pub head: &'static str,
    /// Its width, the maximum for head and figures.
    pub width: usize,
    /// Priority: columns with the largest rank are the first to be left out.
    pub rank: u8,
}

/// A figure and its style.
pub type TableCell = (String, Style);

/// A row: its name, and a figure for each column.
pub type TableRow = (String, Vec<TableCell>);

/// Draws a table called `name`: names on the left, figures on the right. If rows are left
/// out, the last line gives their number.
pub fn render(
    name: &str,
    columns: &[TableColumn],
    rows: &[TableRow],
    theme: &Theme,
    area: Rect,
    buf: &mut Buffer,
) {
    if area.height < 2 && !rows.is_empty() {
        return;
    }
    let room = usize::from(area.width);
    let names = rows.iter().map(|row| pane::width(&row.0));
    let first = names
        .chain([pane::width(name)])
        .max()
        .unwrap_or(0)
        .min(16)
        .min(room);
    let shown = shown(columns, room - first);
    let line = |name: &str, style: Style, figures: &[TableCell]| {
        let name = Line::from(Span::styled(clip(name, first, theme), style));
        let figures = shown.iter().map(|&column| {
            let (text, style) = &figures[column];
            let text = plain(text, theme).into_owned();
            Line::from(Span::styled(text, *style)).right_aligned()
        });
        Row::new(std::iter::once(name).chain(figures))
    };
    let heads = columns.iter();
    let heads: Vec<TableCell> = heads
        .map(|of| (of.head.to_owned(), theme.faint()))
        .collect();
    let fit = usize::from(area.height).saturating_sub(1);
    let whole = match rows.len() > fit {
        true => fit.saturating_sub(1),
        false => rows.len(),
    };
    let lines = rows[..whole].iter();
    let lines = lines.map(|(name, figures)| line(name, Style::new(), figures));
    let widths = shown.iter().map(|&column| columns[column].width);
    let widths = std::iter::once(first).chain(widths).map(clamp);
    let table = Table::new(lines, widths.map(Constraint::Length));
    let table = table.header(line(name, theme.faint(), &heads));
    table.column_spacing(clamp(GAP)).render(area, buf);
    if whole < rows.len() && fit > 0 {
        let more = clip(&format!("… {} more", rows.len() - whole), room, theme);
        put(&more, theme.faint(), 0, row(area, fit), buf);
    }
}

/// The indices of the columns that fit into `room`.
fn shown(columns: &[TableColumn], room: usize) -> Vec<usize> {
    let mut places: Vec<usize> = (0..columns.len()).collect();
    places.sort_by_key(|&place| columns[place].rank);
    let mut left = room;
    let fits = |&place: &usize| match left.checked_sub(GAP + columns[place].width) {
        Some(rest) => {
            left = rest;
            true
        }
        None => false,
    };
    let mut fitting: Vec<usize> = places.into_iter().take_while(fits).collect();
    fitting.sort_unstable();
    fitting
}

#[cfg(test)]
mod tests {
    use ratatui::style::Style;

    use super::{TableColumn, TableRow, render};
    use crate::dashboard::view::pane::testing::{POOR, RICH, screen, text};

    const COLUMNS: [TableColumn; 2] = [
        TableColumn {
            head: "rate Hz",
            width: 7,
            rank: 1,
        },
        TableColumn {
            head: "ticks",
            width: 5,
            rank: 0,
        },
    ];

    fn rows() -> Vec<TableRow> {
        let row = |name: &str, rate: &str, ticks: &str| {
            let figures = [rate, ticks].map(|text| (text.to_owned(), Style::new()));
            (name.to_owned(), figures.to_vec())
        };
        vec![
            row("sensor", "50", "501"),
            row("µ", "–", "7"),
            row("x", "5", "9"),
        ]
    }

    #[test]
    fn figures_are_aligned_and_missing_rows_counted() {
        let buf = screen(24, 3, |area, buf| {
            render("node", &COLUMNS, &rows(), &RICH, area, buf)
        });
        insta::assert_snapshot!(text(&buf), @r"
        node    rate Hz  ticks
        sensor       50    501
        … 2 more
        ");
    }

    #[test]
    fn columns_of_little_weight_go_first() {
        let buf = screen(14, 4, |area, buf| {
            render("node", &COLUMNS, &rows(), &POOR, area, buf)
        });
        insta::assert_snapshot!(text(&buf), @r"
        node    ticks
        sensor    501
        u           7
        x           9
        ");
    }
}

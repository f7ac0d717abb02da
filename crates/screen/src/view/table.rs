//! Tables with fixed columns for changing figures.

use ratatui::{
    layout::Constraint,
    style::Style,
    text::{Line, Span},
    widgets::{Row, Table},
};

use super::{
    sheet::{Sheet, clamp},
    text::{clip, plain, width},
};
use crate::theme::Theme;

/// Blanks between columns.
const GAP: usize = 2;

/// Maximum width of the names.
const LONGEST_NAME: usize = 16;

/// A column of figures about a `T`.
pub struct TableColumn<T> {
    /// Its title, with the unit.
    pub head: &'static str,
    /// Its width, the maximum for head and figures.
    pub width: usize,
    /// Priority: columns with the largest rank are the first to be left out.
    pub rank: u8,
    /// Its figure.
    pub figure: fn(&T, &Theme) -> Span<'static>,
}

/// Returns a column, to be written in one line.
pub const fn column<T>(
    head: &'static str,
    width: usize,
    rank: u8,
    figure: fn(&T, &Theme) -> Span<'static>,
) -> TableColumn<T> {
    TableColumn {
        head,
        width,
        rank,
        figure,
    }
}

/// Draws a table called `title`: names on the left, figures on the right. If rows are left
/// out, the last line gives their number.
pub fn render<T>(
    title: &str,
    columns: &[TableColumn<T>],
    rows: &[T],
    name: fn(&T) -> &str,
    mut sheet: Sheet<'_>,
) {
    let (theme, room, height) = (sheet.theme, sheet.width(), sheet.height());
    if height < 2 && !rows.is_empty() {
        return;
    }
    let first = rows
        .iter()
        .map(name)
        .chain([title])
        .map(width)
        .max()
        .unwrap_or(0)
        .min(LONGEST_NAME)
        .min(room);
    let shown = shown(columns, room - first);
    let row = |name: &str, style: Style, figures: Vec<Span<'static>>| {
        let name = Line::styled(clip(name, first, theme), style);
        let cells = figures.into_iter().map(|figure| {
            let text = plain(&figure.content, theme).into_owned();
            Line::from(Span::styled(text, figure.style)).right_aligned()
        });
        Row::new([name].into_iter().chain(cells))
    };
    let fit = height.saturating_sub(1);
    let whole = if rows.len() > fit {
        fit.saturating_sub(1)
    } else {
        rows.len()
    };
    let lines = rows[..whole].iter().map(|of| {
        let figures = shown.iter().map(|column| (column.figure)(of, theme));
        row(name(of), Style::new(), figures.collect())
    });
    let heads = shown
        .iter()
        .map(|column| Span::styled(column.head, theme.faint()));
    let widths = shown.iter().map(|column| column.width);
    let widths = [first].into_iter().chain(widths).map(clamp);
    let table = Table::new(lines, widths.map(Constraint::Length))
        .header(row(title, theme.faint(), heads.collect()))
        .column_spacing(clamp(GAP));
    sheet.widget(table);
    if whole < rows.len() {
        let more = format!("… {} more", rows.len() - whole);
        sheet.put(0, fit, &more, theme.faint());
    }
}

/// Returns the columns that fit into `room`.
fn shown<T>(columns: &[TableColumn<T>], room: usize) -> Vec<&TableColumn<T>> {
    let mut places: Vec<usize> = (0..columns.len()).collect();
    places.sort_by_key(|&place| columns[place].rank);
    let mut used = 0;
    places.retain(|&place| {
        used += GAP + columns[place].width;
        used <= room
    });
    places.sort_unstable();
    places.into_iter().map(|place| &columns[place]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::testing::{POOR, RICH, drawn};

    /// Name, rate and ticks.
    type Sample = (&'static str, &'static str, &'static str);

    const COLUMNS: [TableColumn<Sample>; 2] = [
        column("rate Hz", 7, 1, |row, _| row.1.into()),
        column("ticks", 5, 0, |row, _| row.2.into()),
    ];
    const ROWS: [Sample; 3] = [("sensor", "50", "501"), ("µ", "–", "7"), ("x", "5", "9")];

    #[test]
    fn figures_are_aligned_missing_rows_counted_and_columns_of_little_weight_go_first() {
        let shown = |size, theme| {
            drawn(size, theme, |sheet| {
                render("node", &COLUMNS, &ROWS, |row| row.0, sheet);
            })
        };
        insta::assert_snapshot!(shown((24, 3), &RICH), @r"
        node    rate Hz  ticks
        sensor       50    501
        … 2 more
        ");
        insta::assert_snapshot!(shown((14, 4), &POOR), @r"
        node    ticks
        sensor    501
        u           7
        x           9
        ");
    }
}

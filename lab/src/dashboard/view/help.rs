//! All keys, over everything else.

use ratatui::{
    buffer::Buffer,
    layout::Rect,
    style::Style,
    text::Span,
    widgets::{Clear, Widget},
};

use super::{
    pane::{border, centred, clip, plain, put, row, width},
    theme::Theme,
};

/// Title of the overlay.
const TITLE: &str = "keys (any key closes)";

/// Blanks between a key and what it does, and between two columns.
const KEY_GAP: usize = 2;
const COLUMN_GAP: usize = 4;

/// Columns that the box takes besides the text: lines and blanks.
const EDGES: usize = 4;

/// Draws keys and what they do in the middle of `area`: in one column, or in
/// two if one is too high.
pub fn render(rows: &[(String, String)], theme: &Theme, area: Rect, buf: &mut Buffer) {
    let area = area.intersection(buf.area);
    let widest = |text: fn(&(String, String)) -> &String| {
        let widths = rows.iter().map(|row| width(&plain(text(row), theme)));
        widths.max().unwrap_or(0)
    };
    let keys = widest(|row| &row.0);
    let column = keys + KEY_GAP + widest(|row| &row.1);
    let room = usize::from(area.height.saturating_sub(2));
    let both = 2 * column + COLUMN_GAP + EDGES <= usize::from(area.width);
    let columns = if rows.len() > room && both { 2 } else { 1 };
    let high = rows.len().div_ceil(columns);
    let wide = (columns * column + (columns - 1) * COLUMN_GAP).max(TITLE.len());
    let place = centred(wide + EDGES, high + 2, area);
    Clear.render(place, buf);
    let inner = border(TITLE, Span::default(), theme, true, place, buf);
    let fit = usize::from(inner.height);
    let cut = high > fit;
    for (number, (key, what)) in rows.iter().enumerate() {
        let (across, down) = (number / high, number % high);
        // The last line marks that there is more.
        if down >= fit - usize::from(cut && fit > 0) {
            continue;
        }
        let x = 1 + across * (column + COLUMN_GAP);
        let place = row(inner, down);
        let room = |x: usize| usize::from(inner.width).saturating_sub(x);
        put(&clip(key, room(x), theme), theme.strong(), x, place, buf);
        let x = x + keys + KEY_GAP;
        put(&clip(what, room(x), theme), Style::new(), x, place, buf);
    }
    if cut && fit > 0 {
        let more = theme.glyph("…", "...");
        put(more, theme.faint(), 1, row(inner, fit - 1), buf);
    }
}

#[cfg(test)]
mod tests {
    use ratatui::{buffer::Buffer, style::Style};

    use super::render;
    use crate::dashboard::view::{
        pane::{
            put, row,
            testing::{POOR, RICH, screen, text, torture},
        },
        theme::Theme,
    };

    fn keys() -> Vec<(String, String)> {
        let rows = [
            ("[ ]", "control rate down, up"),
            ("< >", "depth of the topic"),
            ("space", "pause or go on"),
            ("← →", "look back"),
            ("q", "quit"),
        ];
        rows.map(|(key, what)| (key.to_owned(), what.to_owned()))
            .to_vec()
    }

    fn help(width: u16, height: u16, theme: &Theme) -> Buffer {
        screen(width, height, |area, buf| {
            put(
                &"x".repeat(usize::from(width)),
                Style::new(),
                0,
                row(area, 1),
                buf,
            );
            render(&keys(), theme, area, buf);
        })
    }

    #[test]
    fn keys_are_in_one_column_over_everything() {
        insta::assert_snapshot!(text(&help(40, 7, &RICH)), @r"
            ┌keys (any key closes)─────────┐
        xxxx│ [ ]    control rate down, up │xxxx
            │ < >    depth of the topic    │
            │ space  pause or go on        │
            │ ← →    look back             │
            │ q      quit                  │
            └──────────────────────────────┘
        ");
    }

    #[test]
    fn keys_are_in_two_columns_where_one_is_too_high() {
        insta::assert_snapshot!(text(&help(70, 5, &POOR)), @r"
           +keys (any key closes)-----------------------------------------+
        xxx| [ ]    control rate down, up    <- ->  look back             |xxx
           | < >    depth of the topic       q      quit                  |
           | space  pause or go on                                        |
           +--------------------------------------------------------------+
        ");
    }

    #[test]
    fn what_is_cut_is_marked() {
        insta::assert_snapshot!(text(&help(28, 5, &RICH)), @r"
        ┌keys (any key closes)─────┐
        │ [ ]    control rate down…│
        │ < >    depth of the topic│
        │ …                        │
        └──────────────────────────┘
        ");
    }

    #[test]
    fn any_size_will_do() {
        torture(|theme, area, buf| render(&keys(), theme, area, buf));
        torture(|theme, area, buf| render(&[], theme, area, buf));
    }
}

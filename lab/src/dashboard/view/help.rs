//! Keys or words with their meanings, over everything else.

use ratatui::{
    buffer::Buffer,
    layout::Rect,
    style::Style,
    text::Span,
    widgets::{Clear, Widget},
};

use super::pane::{border, centred, clip, plain, put, row, width};
use crate::theme::Theme;

/// Blanks between a key and its action, and between two columns.
pub(super) const KEY_GAP: usize = 2;
const COLUMN_GAP: usize = 4;

/// Width of the frame of the box: lines and blanks.
pub(super) const EDGES: usize = 4;

/// A list of keys or words, with a scroll position.
#[derive(Clone, Debug, PartialEq)]
pub struct HelpPage {
    /// Its title.
    pub title: &'static str,
    /// Keys and their actions, the most important first, or words and their meanings.
    pub rows: Vec<(String, String)>,
    /// Number of rows scrolled past.
    pub scroll: usize,
}

/// Draws the rows in the middle of `area`: in one column, or in two if one
/// is too high.
pub fn render(help: &HelpPage, theme: &Theme, area: Rect, buf: &mut Buffer) {
    let HelpPage {
        title,
        rows,
        scroll,
    } = help;
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
    let wide = (columns * column + (columns - 1) * COLUMN_GAP).max(title.len());
    let place = centred(wide + EDGES, high + 2, area);
    Clear.render(place, buf);
    let inner = border(title, Span::default(), theme, true, place, buf);
    let fit = usize::from(inner.height);
    // The last line points to the hidden ones.
    let shown = if high > fit {
        fit.saturating_sub(1)
    } else {
        fit
    };
    let first = (*scroll).min(high.saturating_sub(shown));
    for (number, (key, what)) in rows.iter().enumerate() {
        let (across, down) = (number / high, number % high);
        if !(first..first + shown).contains(&down) {
            continue;
        }
        let x = 1 + across * (column + COLUMN_GAP);
        let place = row(inner, down - first);
        let room = |x: usize| usize::from(inner.width).saturating_sub(x);
        put(&clip(key, room(x), theme), theme.strong(), x, place, buf);
        let x = x + keys + KEY_GAP;
        put(&clip(what, room(x), theme), Style::new(), x, place, buf);
    }
    if shown < fit {
        let rest = high - shown - first;
        let above = format!("{} {first} above", theme.glyph("↑", "up"));
        let below = format!("{} {rest} below", theme.glyph("↓", "down"));
        let more = match (first, rest) {
            (0, _) => below,
            (_, 0) => above,
            _ => format!("{above}  {below}"),
        };
        let place = row(inner, fit - 1);
        put(
            &clip(&more, usize::from(inner.width), theme),
            theme.faint(),
            1,
            place,
            buf,
        );
    }
}

#[cfg(test)]
mod tests {
    use ratatui::{buffer::Buffer, style::Style};

    use super::{HelpPage, render};
    use crate::{
        dashboard::view::pane::{
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

    fn help(width: u16, height: u16, scroll: usize, theme: &Theme) -> Buffer {
        screen(width, height, |area, buf| {
            put(
                &"x".repeat(usize::from(width)),
                Style::new(),
                0,
                row(area, 1),
                buf,
            );
            render(
                &HelpPage {
                    title: "keys",
                    rows: keys(),
                    scroll,
                },
                theme,
                area,
                buf,
            );
        })
    }

    #[test]
    fn keys_are_in_one_column_over_everything() {
        insta::assert_snapshot!(text(&help(40, 7, 0, &RICH)), @r"
            ┌keys──────────────────────────┐
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
        insta::assert_snapshot!(text(&help(70, 5, 0, &POOR)), @r"
           +keys----------------------------------------------------------+
        xxx| [ ]    control rate down, up    <- ->  look back             |xxx
           | < >    depth of the topic       q      quit                  |
           | space  pause or go on                                        |
           +--------------------------------------------------------------+
        ");
    }

    #[test]
    fn keys_that_do_not_fit_are_scrolled_to() {
        let drawn = [0, 1, 9].map(|scroll| text(&help(28, 5, scroll, &RICH)));
        insta::assert_snapshot!(drawn.join("\n"));
    }

    #[test]
    fn any_size_will_do() {
        for scroll in [0, 2, usize::MAX] {
            let page = |rows| HelpPage {
                title: "keys",
                rows,
                scroll,
            };
            torture(|theme, area, buf| render(&page(keys()), theme, area, buf));
            torture(|theme, area, buf| render(&page(Vec::new()), theme, area, buf));
        }
    }
}

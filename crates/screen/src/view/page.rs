//! The drawing of a page over everything else.

use ratatui::{
    style::Style,
    text::{Line, Span},
};

use super::{
    sheet::{Sheet, columns, rows},
    text::{broken, clip, line, pad, plain, tail, width},
};
use crate::{panes::Page, theme::Theme};

/// Maximum width of a text, and of the box around it.
const WIDEST: usize = 80;
pub const EDGES: usize = 4;

/// Blanks between a key and its action, and between two columns of them.
pub const KEY_GAP: usize = 2;
const COLUMN_GAP: usize = 4;

/// Rows for the box, and for the hint.
const BORDERS: usize = 2;
const HINT: usize = 1;

/// Draws `page` with the height of its content.
pub fn render(page: &Page, mut sheet: Sheet<'_>) {
    sheet.focused = true;
    let theme = sheet.theme;
    let (lines, wide) = page.lines(theme, (sheet.width(), sheet.height()));
    let wide = (wide + EDGES).min(sheet.width());
    let high = (lines.len() + page.below() + BORDERS).min(sheet.height());
    let spare = [sheet.width() - wide, sheet.height() - high];
    let [left, top] = if page.aside {
        [0, spare[1]]
    } else {
        spare.map(|spare| spare / 2)
    };
    let place = rows(columns(sheet.area, left, wide), top, high);
    let mut cleared = sheet.part(place);
    cleared.clear();
    page.fill(lines, cleared.boxed(&page.title, Span::default()));
}

impl Page {
    /// Returns the content in lines for an area of `size`, and their width.
    fn lines(&self, theme: &Theme, size: (usize, usize)) -> (Vec<Line<'static>>, usize) {
        if !self.rows.is_empty() {
            let (lines, wide) = in_columns(&self.rows, theme, size);
            return (lines, wide.max(self.title.len()));
        }
        let room = size.0.saturating_sub(EDGES).min(WIDEST);
        let lines = self.text.lines().flat_map(|line| broken(line, room, theme));
        (lines.map(Line::raw).collect(), room)
    }

    /// Rows below the lines.
    fn below(&self) -> usize {
        match self.hint {
            "" => 0,
            _ => usize::from(self.typed.is_some()) * 2 + HINT + 1,
        }
    }

    /// Writes the visible lines, and below them what is typed and the hint.
    fn fill(&self, lines: Vec<Line<'static>>, mut sheet: Sheet<'_>) {
        let (theme, height) = (sheet.theme, sheet.height());
        let hidden = lines.len() + self.below() > height;
        let below = self.below().max(usize::from(hidden) * HINT);
        let shown = height.saturating_sub(below);
        // Scrolling ends at the last lines.
        let first = self.scroll.min(lines.len().saturating_sub(shown));
        let rest = lines.len().saturating_sub(first + shown);
        sheet.lines(1, 0, lines.into_iter().skip(first).take(shown));
        if below == 0 {
            return;
        }
        let room = sheet.width().saturating_sub(2);
        if let Some(typed) = &self.typed {
            let typed = tail(&plain(typed, theme), room.saturating_sub(3));
            sheet.put(
                1,
                height.saturating_sub(3),
                &format!("> {typed}▏"),
                theme.strong(),
            );
        }
        let hint = clip(&self.last_line(first, rest), room, theme);
        sheet.put(1, height.saturating_sub(1), &hint, theme.faint());
    }

    /// Returns the hint, or else the numbers of lines above and below the visible ones.
    fn last_line(&self, first: usize, rest: usize) -> String {
        let (above, below) = (format!("↑ {first} above"), format!("↓ {rest} below"));
        match (self.hint, first, rest) {
            ("", 0, _) => below,
            ("", _, 0) => above,
            ("", ..) => format!("{above}  {below}"),
            (hint, _, 0) => hint.to_owned(),
            (hint, ..) => format!("PgDn for more  {hint}"),
        }
    }
}

/// Returns `rows` in lines for an area of `size`, in one column or in two, and their width.
fn in_columns(
    rows: &[(&str, &str)],
    theme: &Theme,
    size: (usize, usize),
) -> (Vec<Line<'static>>, usize) {
    let widest = |texts: &[&str]| {
        let widths = texts.iter().map(|text| width(&plain(text, theme)));
        widths.max().unwrap_or(0)
    };
    let (keys, meanings): (Vec<&str>, Vec<&str>) = rows.iter().copied().unzip();
    let (keys, meanings) = (widest(&keys), widest(&meanings));
    let column = keys + KEY_GAP + meanings;
    let both = 2 * column + COLUMN_GAP;
    let low = rows.len() + BORDERS <= size.1;
    let (columns, wide) = if both + EDGES <= size.0 && !low {
        (2, both)
    } else {
        (1, column)
    };
    let high = rows.len().div_ceil(columns);
    let lines = (0..high).map(|down| {
        let cells = rows.iter().skip(down).step_by(high);
        line(cells.flat_map(|(key, what)| {
            [
                (pad(key, keys + KEY_GAP, theme), theme.strong()),
                (pad(what, meanings + COLUMN_GAP, theme), Style::new()),
            ]
        }))
    });
    (lines.collect(), wide)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::testing::*;

    fn page() -> Page {
        Page {
            typed: Some("0 because what is old is old".to_owned()),
            ..Page::text(
                "2 A deeper queue",
                "The policy is slowed to 5 Hz, where it loses the pole and most readings.\n\n\
                 How many of the three runs does the deep queue save?"
                    .to_owned(),
                "a number and why, then Enter  Esc back",
            )
        }
    }

    #[test]
    fn text_is_broken_and_what_is_typed_stays_in_sight() {
        let shown = |size, theme| drawn(size, theme, |sheet| render(&page(), sheet));
        insta::assert_snapshot!(shown((50, 12), &RICH), @"
        ┌2 A deeper queue────────────────────────────────┐
        │ The policy is slowed to 5 Hz, where it loses   │
        │ the pole and most readings.                    │
        │                                                │
        │ How many of the three runs does the deep queue │
        │ save?                                          │
        │                                                │
        │ > 0 because what is old is old▏                │
        │                                                │
        │ a number and why, then Enter  Esc back         │
        └────────────────────────────────────────────────┘
        ");
        insta::assert_snapshot!(shown((36, 9), &RICH), @"
        ┌2 A deeper queue──────────────────┐
        │ The policy is slowed to 5 Hz,    │
        │ where it loses the pole and most │
        │ readings.                        │
        │                                  │
        │ > 0 because what is old is old▏  │
        │                                  │
        │ PgDn for more  a number and why… │
        └──────────────────────────────────┘
        ");
        assert!(shown((50, 12), &POOR).is_ascii());
    }

    fn keys() -> Vec<(&'static str, &'static str)> {
        vec![
            ("[ ]", "control rate down, up"),
            ("< >", "depth of the topic"),
            ("space", "pause or go on"),
            ("← →", "look back"),
            ("q", "quit"),
        ]
    }

    fn help(size: (u16, u16), scroll: usize, theme: &Theme) -> String {
        let page = Page {
            scroll,
            ..Page::rows("keys", keys())
        };
        drawn(size, theme, |mut sheet| {
            sheet.put(0, 1, &"x".repeat(sheet.width()), Style::new());
            render(&page, sheet);
        })
    }

    #[test]
    fn keys_are_in_one_column_over_everything() {
        insta::assert_snapshot!(help((40, 7), 0, &RICH), @r"
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
        insta::assert_snapshot!(help((70, 5), 0, &POOR), @r"
           +keys----------------------------------------------------------+
        xxx| [ ]    control rate down, up    <- ->  look back             |xxx
           | < >    depth of the topic       q      quit                  |
           | space  pause or go on                                        |
           +--------------------------------------------------------------+
        ");
    }

    #[test]
    fn keys_that_do_not_fit_are_scrolled_to() {
        let drawn = [0, 1, 9].map(|scroll| help((28, 5), scroll, &RICH));
        insta::assert_snapshot!(drawn.join("\n"));
    }

    #[test]
    fn any_size_will_do() {
        let none = Page::rows("keys", Vec::new());
        for page in [page(), Page::rows("keys", keys()), none] {
            for (scroll, aside) in [(0, false), (2, true), (usize::MAX, false)] {
                let page = Page {
                    scroll,
                    aside,
                    ..page.clone()
                };
                torture(|sheet| render(&page, sheet));
            }
        }
    }
}

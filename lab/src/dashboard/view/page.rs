//! A page over everything else: the keys, the words, an explanation, an exercise, a step of
//! the tour.

use ratatui::{
    buffer::Buffer,
    layout::Rect,
    text::{Line, Span},
    widgets::{Clear, Widget},
};

use super::pane::{border, broken, centred, clip, from, plain, put, row, tail, width};
use crate::theme::Theme;

/// Maximum width of a text, and of the box around it.
const WIDEST: usize = 80;
pub(super) const EDGES: usize = 4;

/// Blanks between a key and its action, and between two columns of them.
pub(super) const KEY_GAP: usize = 2;
const COLUMN_GAP: usize = 4;

/// Rows for the box, and for the hint.
const BORDERS: usize = 2;
const HINT: usize = 1;

/// A page.
#[derive(Clone, Debug, PartialEq)]
pub struct Page {
    /// Its title.
    pub title: String,
    /// Paragraphs, to be wrapped.
    pub text: String,
    /// In their place keys and their actions, the most important first, or words and their
    /// meanings: in two columns if one is too high.
    pub rows: Vec<(String, String)>,
    /// The text of the input line, if there is one.
    pub typed: Option<String>,
    /// Keys and their actions, below it.
    pub hint: &'static str,
    /// The same for the bottom line of the screen.
    pub keys: &'static [(&'static str, &'static str)],
    /// Number of lines scrolled past.
    pub scroll: usize,
    /// Whether it is at the bottom, so that something of the area stays in sight, and not
    /// in the middle.
    pub aside: bool,
}

/// Draws `page` in `area`, with the height of its content.
pub fn render(page: &Page, theme: &Theme, area: Rect, buf: &mut Buffer) {
    let area = area.intersection(buf.area);
    let (lines, wide) = page.lines(theme, area);
    let mut place = centred(wide + EDGES, page.height(&lines), area);
    if page.aside {
        (place.x, place.y) = (area.x, area.bottom() - place.height);
    }
    page.draw(&lines, theme, place, buf);
}

impl Page {
    /// A page of paragraphs.
    pub fn text(title: impl Into<String>, text: String, hint: &'static str) -> Self {
        Self {
            title: title.into(),
            text,
            rows: Vec::new(),
            typed: None,
            hint,
            keys: &[],
            scroll: 0,
            aside: false,
        }
    }

    /// A page of keys or words.
    pub fn rows(title: &str, rows: Vec<(String, String)>) -> Self {
        Self {
            rows,
            ..Self::text(title, String::new(), "")
        }
    }

    /// The content in lines for `area`, and their width.
    fn lines(&self, theme: &Theme, area: Rect) -> (Vec<Line<'static>>, usize) {
        if !self.rows.is_empty() {
            let (lines, wide) = in_columns(&self.rows, theme, area);
            return (lines, wide.max(self.title.len()));
        }
        let room = usize::from(area.width).saturating_sub(EDGES).min(WIDEST);
        let text = plain(&self.text, theme);
        let lines = text.lines().flat_map(|line| broken(line, room.max(1)));
        (lines.map(Line::raw).collect(), room)
    }

    /// Rows below the lines.
    fn below(&self) -> usize {
        match self.hint {
            "" => 0,
            _ => usize::from(self.typed.is_some()) * 2 + HINT + 1,
        }
    }

    /// Rows of the whole box.
    fn height(&self, lines: &[Line<'_>]) -> usize {
        lines.len() + self.below() + BORDERS
    }

    fn draw(&self, lines: &[Line<'_>], theme: &Theme, place: Rect, buf: &mut Buffer) {
        Clear.render(place, buf);
        let inner = border(&self.title, Span::default(), theme, true, place, buf);
        let (height, room) = (usize::from(inner.height), usize::from(inner.width));
        let hidden = lines.len() + self.below() > height;
        let below = self.below().max(usize::from(hidden) * HINT);
        let shown = height.saturating_sub(below);
        // Scrolling ends at the last lines.
        let first = self.scroll.min(lines.len().saturating_sub(shown));
        for (at, line) in lines.iter().skip(first).take(shown).enumerate() {
            line.render(from(row(inner, at), 1), buf);
        }
        if below == 0 {
            return;
        }
        let room = room.saturating_sub(2);
        let mut draw = |text: &str, style, above: usize| {
            let place = row(inner, height.saturating_sub(above));
            put(text, style, 1, place, buf);
        };
        if let Some(typed) = &self.typed {
            let mark = theme.glyph("▏", "_");
            let typed = tail(&plain(typed, theme), room.saturating_sub(3));
            draw(&format!("> {typed}{mark}"), theme.strong(), 3);
        }
        let rest = lines.len().saturating_sub(first + shown);
        let hint = self.last_line(first, rest, theme);
        draw(&clip(&hint, room, theme), theme.faint(), 1);
    }

    /// The hint, or else the numbers of lines above and below those in sight.
    fn last_line(&self, first: usize, rest: usize, theme: &Theme) -> String {
        let above = format!("{} {first} above", theme.glyph("↑", "up"));
        let below = format!("{} {rest} below", theme.glyph("↓", "down"));
        match (self.hint, first, rest) {
            ("", 0, _) => below,
            ("", _, 0) => above,
            ("", ..) => format!("{above}  {below}"),
            (hint, _, 0) => hint.to_owned(),
            (hint, ..) => format!("PgDn for more  {hint}"),
        }
    }
}

/// `rows` in lines for `area`, in one column or in two, and their width.
fn in_columns(rows: &[(String, String)], theme: &Theme, area: Rect) -> (Vec<Line<'static>>, usize) {
    let widest = |text: fn(&(String, String)) -> &String| {
        let widths = rows.iter().map(|row| width(&plain(text(row), theme)));
        widths.max().unwrap_or(0)
    };
    let keys = widest(|row| &row.0);
    let column = keys + KEY_GAP + widest(|row| &row.1);
    let both = 2 * column + COLUMN_GAP;
    let low = rows.len() + BORDERS <= usize::from(area.height);
    let (columns, wide) = match both + EDGES <= usize::from(area.width) && !low {
        true => (2, both),
        false => (1, column),
    };
    let high = rows.len().div_ceil(columns);
    let room = usize::from(area.width).saturating_sub(EDGES - 1);
    let lines = (0..high).map(|down| {
        let mut line = Line::default();
        for (key, what) in rows.iter().skip(down).step_by(high) {
            let start = match line.width() {
                0 => 0,
                _ => column + COLUMN_GAP,
            };
            line.push_span(" ".repeat(start - line.width()));
            line.push_span(Span::styled(clip(key, room, theme), theme.strong()));
            let start = (start + keys + KEY_GAP).min(room);
            line.push_span(" ".repeat(start.saturating_sub(line.width())));
            line.push_span(clip(what, room - start, theme));
        }
        line
    });
    (lines.collect(), wide)
}

#[cfg(test)]
mod tests {
    use ratatui::{buffer::Buffer, style::Style};

    use super::{Page, render};
    use crate::{
        dashboard::view::pane::{
            put, row,
            testing::{POOR, RICH, screen, text, torture},
        },
        theme::Theme,
    };

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
        let drawn =
            |width, height| screen(width, height, |area, buf| render(&page(), &RICH, area, buf));
        insta::assert_snapshot!(text(&drawn(50, 12)), @"
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
        insta::assert_snapshot!(text(&drawn(36, 9)), @"
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
        let poor = screen(50, 12, |area, buf| render(&page(), &POOR, area, buf));
        assert!(text(&poor).is_ascii());
    }

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
            let page = Page {
                scroll,
                ..Page::rows("keys", keys())
            };
            render(&page, theme, area, buf);
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
        let kinds = [
            page(),
            Page::rows("keys", keys()),
            Page::rows("keys", Vec::new()),
        ];
        for page in kinds {
            for scroll in [0, 2, usize::MAX] {
                let page = Page {
                    scroll,
                    aside: scroll == 2,
                    typed: page.typed.clone().filter(|_| scroll == 0),
                    ..page.clone()
                };
                torture(|theme, area, buf| render(&page, theme, area, buf));
            }
        }
    }
}

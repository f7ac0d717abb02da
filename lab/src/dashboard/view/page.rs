//! A page of text over everything else.

use ratatui::{
    buffer::Buffer,
    layout::Rect,
    style::Style,
    text::Span,
    widgets::{Clear, Widget},
};

use super::pane::{border, broken, centred, clamp, clip, plain, put, row, tail};
use crate::theme::Theme;

/// Maximum width of the text, and of the box around it.
const WIDEST: usize = 80;
const EDGES: usize = 4;

/// Rows for the box, and for the hint.
const BORDERS: usize = 2;
const HINT: usize = 1;

/// A page of text.
#[derive(Clone, Debug, PartialEq)]
pub struct TextPage {
    /// Its title.
    pub title: String,
    /// Paragraphs, to be wrapped.
    pub text: String,
    /// The text of the input line, if there is one.
    pub typed: Option<String>,
    /// Keys and their actions.
    pub hint: &'static str,
    /// Number of lines scrolled past.
    pub scroll: usize,
}

/// Draws `page` in the middle of `area`, with the height of its text.
pub fn render(page: &TextPage, theme: &Theme, area: Rect, buf: &mut Buffer) {
    let area = area.intersection(buf.area);
    let room = usize::from(area.width).saturating_sub(EDGES).min(WIDEST);
    if room == 0 {
        return;
    }
    let lines = lines(page, room, theme);
    let place = centred(room + EDGES, height(page, &lines), area);
    draw(page, &lines, theme, place, buf);
}

/// Draws `page` at the bottom of `area`, so that something of the area stays in sight.
pub fn aside(page: &TextPage, theme: &Theme, area: Rect, buf: &mut Buffer) {
    let area = area.intersection(buf.area);
    let room = usize::from(area.width).saturating_sub(EDGES).min(WIDEST);
    if room == 0 {
        return;
    }
    let lines = lines(page, room, theme);
    let height = clamp(height(page, &lines)).min(area.height);
    let place = Rect {
        y: area.bottom() - height,
        height,
        width: clamp(room + EDGES),
        ..area
    };
    draw(page, &lines, theme, place, buf);
}

/// The text in lines of `room` columns.
fn lines(page: &TextPage, room: usize, theme: &Theme) -> Vec<String> {
    let text = plain(&page.text, theme);
    text.lines().flat_map(|line| broken(line, room)).collect()
}

/// Rows below the text.
fn below(page: &TextPage) -> usize {
    usize::from(page.typed.is_some()) * 2 + HINT + 1
}

/// Rows of the whole box.
fn height(page: &TextPage, lines: &[String]) -> usize {
    lines.len() + below(page) + BORDERS
}

fn draw(page: &TextPage, lines: &[String], theme: &Theme, place: Rect, buf: &mut Buffer) {
    let room = usize::from(place.width).saturating_sub(EDGES);
    Clear.render(place, buf);
    let inner = border(&page.title, Span::default(), theme, true, place, buf);
    let shown = usize::from(inner.height).saturating_sub(below(page));
    // Scrolling ends at the last lines.
    let first = page.scroll.min(lines.len().saturating_sub(shown));
    let mut draw = |text: &str, style, at| put(text, style, 1, row(inner, at), buf);
    for (at, line) in lines.iter().skip(first).take(shown).enumerate() {
        draw(line, Style::new(), at);
    }
    let bottom = usize::from(inner.height);
    if let Some(typed) = &page.typed {
        let mark = theme.glyph("▏", "_");
        let typed = tail(&plain(typed, theme), room.saturating_sub(3));
        let at = bottom.saturating_sub(3);
        draw(&format!("> {typed}{mark}"), theme.strong(), at);
    }
    let more = lines.len() > first + shown;
    let hint = if more { "PgDn for more  " } else { "" }.to_owned() + page.hint;
    let hint = clip(&hint, room, theme);
    draw(&hint, theme.faint(), bottom.saturating_sub(1));
}

#[cfg(test)]
mod tests {
    use super::{TextPage, render};
    use crate::dashboard::view::pane::testing::{POOR, RICH, screen, text, torture};

    fn page() -> TextPage {
        TextPage {
            title: "2 A deeper queue".to_owned(),
            text: "The policy is slowed to 5 Hz, where it loses the pole and most readings.\n\n\
                   How many of the three runs does the deep queue save?"
                .to_owned(),
            typed: Some("0 because what is old is old".to_owned()),
            hint: "a number and why, then Enter  Esc back",
            scroll: 0,
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

    #[test]
    fn any_size_will_do() {
        torture(|theme, area, buf| render(&page(), theme, area, buf));
        let far = TextPage {
            scroll: usize::MAX,
            typed: None,
            ..page()
        };
        torture(|theme, area, buf| render(&far, theme, area, buf));
    }
}

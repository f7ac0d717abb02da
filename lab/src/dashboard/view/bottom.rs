//! The last line: keys, or the line that is typed; and above it what has no other place.

use ratatui::{
    buffer::Buffer,
    layout::Rect,
    text::{Line, Span},
    widgets::{Clear, Widget},
};

use super::{
    ScreenState, events,
    layout::ScreenLayout,
    pane::{self, plain, put, row},
};
use crate::{dashboard::panes::Pane, theme::Theme};

/// Blanks between keys.
const GAP: usize = 2;

/// The content of the last line.
pub struct Bottom<'a> {
    /// Keys and their actions.
    pub hints: Vec<(String, &'static str)>,
    /// The input line, in their place.
    pub prompt: Option<PromptLine<'a>>,
    /// The latest notice of the dashboard.
    pub notice: Option<&'a str>,
}

/// An input line.
pub struct PromptLine<'a> {
    /// The text so far.
    pub typed: &'a str,
    /// The reason why the last entry was refused, above the line.
    pub refusal: Option<&'a str>,
    /// The accepted words, in its place.
    pub hint: String,
}

/// Draws the last line, and above it the refusal or the words of the input line; in its
/// place a notice that fits nowhere else.
pub fn render(shown: &ScreenState<'_>, layout: &ScreenLayout, theme: &Theme, buf: &mut Buffer) {
    let bottom = &shown.bottom;
    let notice = bottom.notice.filter(|_| !notice_fits(shown, layout));
    match (&bottom.prompt, notice) {
        (Some(prompt), _) => {
            prompt.draw(theme, layout.footer, buf);
            let sign = theme.glyph("✖", "!");
            let refusal = prompt.refusal.map(|refusal| format!("{sign} {refusal}"));
            at_the_bottom(
                refusal.as_ref().unwrap_or(&prompt.hint),
                theme,
                layout.body,
                buf,
            );
        }
        (None, Some(notice)) => {
            at_the_bottom(notice, theme, layout.body.union(layout.footer), buf);
        }
        (None, None) => {
            let of_table = bottom.hints.iter().map(|(key, what)| (key.as_str(), *what));
            let mut hints: Vec<_> = match &shown.page {
                Some(page) => page.keys.to_vec(),
                None => of_table.collect(),
            };
            if layout.verdict.is_some() && hints.len() > 2 {
                hints.insert(2, ("Tab 1-6", "other panes"));
            }
            keys(&hints, theme, layout.footer, buf);
        }
    }
}

/// Whether the notice fits into its usual place: the pane of events, or the line of the
/// verdict.
fn notice_fits(shown: &ScreenState<'_>, layout: &ScreenLayout) -> bool {
    let covered = shown.map.is_some() || shown.page.is_some();
    let mut panes = layout.panes.iter();
    let events = panes.find(|(pane, _)| *pane == Pane::Events);
    let line = layout.verdict.map_or(0, |area| area.width);
    let room = events.map_or(line, |(_, area)| events::room(*area));
    let notice = shown.bottom.notice.unwrap_or_default();
    !covered && pane::width(notice) <= usize::from(room)
}

/// Draws as many hints, each a key with its action, as there is room for.
fn keys(hints: &[(&str, &str)], theme: &Theme, area: Rect, buf: &mut Buffer) {
    let line = row(area.intersection(buf.area), 0);
    let hints = hints.iter().map(|(key, what)| {
        let key = Span::styled(plain(key, theme), theme.strong());
        let what = Span::styled(plain(what, theme), theme.faint());
        Line::from_iter([key, Span::raw(" "), what])
    });
    pane::in_a_row(hints, GAP, (0, usize::from(line.width)), line, buf);
}

impl PromptLine<'_> {
    /// The line, with its end visible.
    fn draw(&self, theme: &Theme, area: Rect, buf: &mut Buffer) {
        let room = usize::from(area.width).saturating_sub(3);
        let tail = pane::tail(self.typed, room);
        let spans = [
            Span::styled(": ", theme.strong()),
            Span::raw(plain(&tail, theme)),
            Span::raw(theme.glyph("▏", "_")),
        ];
        Line::from_iter(spans).render(area, buf);
    }
}

/// A wrapped text at the bottom of `area`.
fn at_the_bottom(text: &str, theme: &Theme, area: Rect, buf: &mut Buffer) {
    let lines = pane::broken(&plain(text, theme), usize::from(area.width));
    let first = usize::from(area.height).saturating_sub(lines.len());
    for (number, line) in lines.iter().enumerate() {
        let place = row(area, first + number);
        Clear.render(place, buf);
        put(line, theme.strong(), 0, place, buf);
    }
}

#[cfg(test)]
mod tests {
    use ratatui::layout::Rect;

    use super::keys;
    use crate::dashboard::view::pane::testing::{RICH, screen, styled, text, torture};

    const HINTS: [(&str, &str); 3] = [("[ ]", "control rate"), ("> <", "depth"), ("q", "quit")];

    #[test]
    fn hints_are_whole() {
        let footer = |width| screen(width, 1, |area, buf| keys(&HINTS, &RICH, area, buf));
        insta::assert_snapshot!(text(&footer(40)), @"[ ] control rate  > < depth  q quit");
        insta::assert_snapshot!(text(&footer(30)), @"[ ] control rate  > < depth");
        assert_eq!(styled(&footer(40), RICH.strong()), "[ ]> <q");
    }

    #[test]
    fn any_size_will_do() {
        torture(|theme, area, buf| {
            let last = Rect {
                y: area.bottom().saturating_sub(1),
                ..area
            };
            keys(&HINTS, theme, last, buf);
        });
    }
}

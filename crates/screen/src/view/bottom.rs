//! The lines at the bottom: the position in a recording, and keys.

use ratatui::style::Style;
use ratelab::Time;

use super::{
    ScreenState, events,
    layout::ScreenLayout,
    sheet::Sheet,
    text::{broken, line, side_by_side, tail, width},
};
use crate::{panes::Pane, playback::Playback};

/// Blanks between keys.
const GAP: usize = 2;

/// Draws the last line, and above it the refusal or the words of the input line; in its
/// place a notice that fits nowhere else.
pub fn render(shown: &ScreenState<'_>, layout: &ScreenLayout, mut sheet: Sheet<'_>) {
    let notice = shown.notice.filter(|_| !notice_fits(shown, layout));
    match (shown.prompt.typed(), notice) {
        (Some(text), _) => {
            typed(text, sheet.part(layout.footer));
            let above = match shown.prompt.refusal() {
                Some(refusal) => format!("✖ {refusal}"),
                None => shown.prompt.hint(shown.system),
            };
            at_the_bottom(&above, sheet.part(layout.age.union(layout.body)));
        }
        (None, Some(notice)) => {
            at_the_bottom(notice, sheet.part(layout.body.union(layout.footer)));
        }
        (None, None) => {
            let of_table = shown.hints.iter().map(|(key, what)| (key.as_str(), *what));
            let mut hints: Vec<_> = match &shown.page {
                Some(page) => page.keys.to_vec(),
                None => of_table.collect(),
            };
            if !layout.verdict.is_empty() && hints.len() > 2 {
                hints.insert(2, ("Tab 1-6", "other panes"));
            }
            keys(&hints, sheet.part(layout.footer));
        }
    }
}

/// Returns whether the notice fits into its usual place: the pane of events, or the line of the
/// verdict.
fn notice_fits(shown: &ScreenState<'_>, layout: &ScreenLayout) -> bool {
    let covered = shown.map.is_some() || shown.page.is_some();
    let events = layout.panes.iter().find(|(pane, _)| *pane == Pane::Events);
    let line = usize::from(layout.verdict.width);
    let room = events.map_or(line, |(_, area)| events::room(*area));
    !covered && width(shown.notice.unwrap_or_default()) <= room
}

/// Draws as many hints, each a key with its action, as there is room for.
fn keys(hints: &[(&str, &str)], mut sheet: Sheet<'_>) {
    let theme = sheet.theme;
    let hints = hints.iter().map(|(key, what)| {
        line([
            (*key, theme.strong()),
            (" ", Style::new()),
            (*what, theme.faint()),
        ])
    });
    let hints = side_by_side(hints, GAP, sheet.width(), theme);
    sheet.line(0, 0, &hints);
}

/// The input line, with its end visible.
fn typed(text: &str, mut sheet: Sheet<'_>) {
    let tail = tail(text, sheet.width().saturating_sub(3));
    let begin = sheet.put(0, 0, ": ", sheet.theme.strong());
    sheet.put(begin, 0, &format!("{tail}▏"), Style::new());
}

/// A wrapped text at the bottom.
fn at_the_bottom(text: &str, mut sheet: Sheet<'_>) {
    let lines = broken(text, sheet.width(), sheet.theme);
    let first = sheet.height().saturating_sub(lines.len());
    sheet.rows(first, lines.len()).clear();
    for (number, line) in lines.iter().enumerate() {
        sheet.put(0, first + number, line, sheet.theme.strong());
    }
}

/// Draws the moment as a position on a line, with a mark per event.
pub fn render_scrubber(playback: &Playback, mut sheet: Sheet<'_>) {
    let theme = sheet.theme;
    let sign = if playback.seems_to_play() {
        "▶"
    } else {
        "‖"
    };
    let left = format!(" {sign} {:>8.3} s ", playback.at().as_secs_f64());
    let (end, speed) = (playback.ends().as_secs_f64(), playback.speed);
    let right = format!(" {end:.3} s  {speed}× ");
    let from = sheet.put(0, 0, &left, theme.strong());
    let columns = sheet.width().saturating_sub(from + width(&right));
    if columns == 0 {
        return;
    }
    let place = |at: Time| from + column(playback, at, columns);
    let (here, end) = (place(playback.at()), from + columns);
    sheet.put(from, 0, &"━".repeat(here - from), theme.active());
    sheet.put(here, 0, &"─".repeat(end - here), theme.faint());
    let recording = playback.recording();
    let events = recording.events.iter().map(|event| event.at);
    for at in events.filter(|at| *at >= playback.begins) {
        sheet.put(place(at), 0, "◆", theme.strong());
    }
    sheet.put(here, 0, "●", theme.active());
    sheet.put(end, 0, &right, Style::new());
}

/// Returns the column of `at`, out of `columns`.
fn column(playback: &Playback, at: Time, columns: usize) -> usize {
    let whole = playback.ends().since(playback.begins).as_secs_f64();
    let part = at.since(playback.begins).as_secs_f64();
    let share = if whole > 0.0 { part / whole } else { 1.0 };
    let last = columns - 1;
    ((share * last as f64).round() as usize).min(last)
}

#[cfg(test)]
mod tests {
    use super::keys;
    use crate::view::testing::*;

    const HINTS: [(&str, &str); 3] = [("[ ]", "control rate"), ("> <", "depth"), ("q", "quit")];

    #[test]
    fn hints_are_whole() {
        let footer = |width| screen((width, 1), &RICH, |sheet| keys(&HINTS, sheet));
        insta::assert_snapshot!(text(&footer(40)), @"[ ] control rate  > < depth  q quit");
        insta::assert_snapshot!(text(&footer(30)), @"[ ] control rate  > < depth");
        assert_eq!(styled(&footer(40), RICH.strong()), "[ ]> <q");
    }

    #[test]
    fn any_size_will_do() {
        torture(|sheet| keys(&HINTS, sheet));
    }
}

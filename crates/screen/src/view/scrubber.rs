//! The position in a recording.

use ratatui::style::Style;
use ratelab::Time;

use super::{sheet::Sheet, text::width};
use crate::playback::Playback;

/// Draws the moment as a position on a line, with a mark per event.
pub fn render(playback: &Playback, mut sheet: Sheet<'_>) {
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

//! The position in a recording.

use ratatui::style::Style;
use ratelab::Time;

use super::{sheet::Sheet, text::width};

/// A position in a recording.
pub struct Scrubber {
    /// The beginning of the recording.
    pub begins: Time,
    /// The visible moment.
    pub at: Time,
    /// The end of the recording.
    pub ends: Time,
    /// Run times of events.
    pub events: Vec<Time>,
    /// Whether it plays.
    pub playing: bool,
    /// Ratio of run time to wall time.
    pub speed: f64,
}

/// Draws the moment as a position on a line, with a mark per event.
pub fn render(scrubber: &Scrubber, mut sheet: Sheet<'_>) {
    let theme = sheet.theme;
    let sign = if scrubber.playing { "▶" } else { "‖" };
    let left = format!(" {sign} {:>8.3} s ", scrubber.at.as_secs_f64());
    let (end, speed) = (scrubber.ends.as_secs_f64(), scrubber.speed);
    let right = format!(" {end:.3} s  {speed}× ");
    let from = sheet.put(0, 0, &left, theme.strong());
    let columns = sheet.width().saturating_sub(from + width(&right));
    if columns == 0 {
        return;
    }
    let place = |at: Time| from + column(scrubber, at, columns);
    let (here, end) = (place(scrubber.at), from + columns);
    sheet.put(from, 0, &"━".repeat(here - from), theme.active());
    sheet.put(here, 0, &"─".repeat(end - here), theme.faint());
    for at in scrubber.events.iter().filter(|at| **at >= scrubber.begins) {
        sheet.put(place(*at), 0, "◆", theme.strong());
    }
    sheet.put(here, 0, "●", theme.active());
    sheet.put(end, 0, &right, Style::new());
}

/// The column of `at`, out of `columns`.
fn column(scrubber: &Scrubber, at: Time, columns: usize) -> usize {
    let whole = scrubber.ends.since(scrubber.begins).as_secs_f64();
    let part = at.since(scrubber.begins).as_secs_f64();
    let share = if whole > 0.0 { part / whole } else { 1.0 };
    let last = columns - 1;
    ((share * last as f64).round() as usize).min(last)
}

//! The position in a recording.

use ratatui::{buffer::Buffer, layout::Rect, style::Style};
use ratelab::Time;

use super::pane::{plain, put, row, width};
use crate::theme::Theme;

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
pub fn render(scrubber: &Scrubber, theme: &Theme, area: Rect, buf: &mut Buffer) {
    let line = row(area.intersection(buf.area), 0);
    let mut draw = |text: &str, style, x| put(text, style, x, line, buf);
    let sign = if scrubber.playing {
        theme.glyph("▶", ">")
    } else {
        theme.glyph("‖", "=")
    };
    let left = format!(" {sign} {:>8.3} s ", scrubber.at.as_secs_f64());
    let (end, speed) = (scrubber.ends.as_secs_f64(), scrubber.speed);
    let right = format!(" {end:.3} s  {speed}× ");
    let (left, right) = (plain(&left, theme), plain(&right, theme));
    draw(&left, theme.strong(), 0);
    let from = width(&left);
    let columns = usize::from(line.width).saturating_sub(from + width(&right));
    if columns == 0 {
        return;
    }
    let place = |at: Time| from + column(scrubber, at, columns);
    let (here, end) = (place(scrubber.at), from + columns);
    let (done, ahead) = (theme.glyph("━", "="), theme.glyph("─", "-"));
    draw(&done.repeat(here - from), theme.active(), from);
    draw(&ahead.repeat(end - here), theme.faint(), here);
    for at in scrubber.events.iter().filter(|at| **at >= scrubber.begins) {
        draw(theme.glyph("◆", "*"), theme.strong(), place(*at));
    }
    draw(theme.glyph("●", "O"), theme.active(), here);
    draw(&right, Style::new(), end);
}

/// The column of `at`, out of `columns`.
fn column(scrubber: &Scrubber, at: Time, columns: usize) -> usize {
    let whole = scrubber.ends.since(scrubber.begins).as_secs_f64();
    let part = at.since(scrubber.begins).as_secs_f64();
    let share = if whole > 0.0 { part / whole } else { 1.0 };
    let last = columns - 1;
    ((share * last as f64).round() as usize).min(last)
}
